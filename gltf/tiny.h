// tinygltf, whose types and writer we use, in a namespace of our own; what we say in kinespace:: as tinygltf::.
//
// Other libraries carry copies of tinygltf, laid out otherwise and exported (Debian's libdraco.so): under the common
// name the linker gives whichever comes first, and reading or writing overwrites memory. So the header-only library is
// compiled once, in gltf/tiny.cpp, under a name that nobody else has, and nothing of that name is linked. Pictures and
// files are not its business: both are left out.
#pragma once

#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_FS

#pragma push_macro("TINY_GLTF_H_")
#undef TINY_GLTF_H_
#define tinygltf kinespace_tinygltf
#include <tiny_gltf.h>
#undef tinygltf
#pragma pop_macro("TINY_GLTF_H_")

namespace kinespace {
namespace tinygltf = ::kinespace_tinygltf;
}
