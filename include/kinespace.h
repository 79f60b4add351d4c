// What most programs want of kinespace, in one line: clips and their files, the motion space, the library, synthesis, feet, codecs.
// Every header here can be included alone, and is its own manual.
#pragma once

#include "kinespace/base/error.h"
#include "kinespace/codecs/registry.h"
#include "kinespace/footskate/cleanup.h"
#include "kinespace/footskate/skate_measures.h"
#include "kinespace/fpca/motion_space.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/library/library_view.h"
#include "kinespace/mesh/mesh_files.h"
#include "kinespace/mesh_codecs/mesh_codec.h"
#include "kinespace/motion/clip.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"
#include "kinespace/repeats/repeats.h"
#include "kinespace/synthesis/motion_engine.h"
#include "kinespace/version.h"
