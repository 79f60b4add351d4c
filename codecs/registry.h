// Codecs by their name. A new codec is a folder with a class of Codec, and one row in registry.cpp.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

[[nodiscard]] std::span<const Codec* const> all_codecs();
// Throws Error{usage} naming those there are.
[[nodiscard]] const Codec& find_codec(std::string_view name);
[[nodiscard]] const CodecSetting& find_setting(const Codec& codec, std::string_view name);

// Checks clips and options, then encodes.
[[nodiscard]] Bytes encode(std::string_view codec, std::span<const Clip> clips, const CodecOptions& options = {});
// The same by a codec that need not be registered.
[[nodiscard]] Bytes encode(const Codec& codec, std::span<const Clip> clips, const CodecOptions& options = {});

// Whether the bytes are a stream of clips, whole or the beginning of one.
[[nodiscard]] bool is_clip_stream(std::span<const std::byte> bytes);
// Opens a stream by the codec that made it; one that was cut short inside its levels of detail opens too. The bytes
// must outlive the reader. `basis`: where the stream was made with one (basis_of). Throws Error{bad_input}, and
// Error{usage} when the basis it needs is not given.
[[nodiscard]] std::unique_ptr<StreamReader> open_stream(std::span<const std::byte> bytes, std::string source,
                                                        const PoseSpaceBasis* basis = nullptr);

// The id of the basis that a stream needs; empty when it needs none. Throws Error{bad_input}.
[[nodiscard]] std::string basis_of(std::span<const std::byte> bytes, std::string source);

}  // namespace kinespace
