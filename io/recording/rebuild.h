// The plant that a recording was made with, built again from what the recording holds.
#pragma once

#include "io/model_file.h"
#include "io/recording/manifest.h"
#include "plant/plant.h"

namespace shiftrig::io {

// The recorded model text, with the recorded options in use. Throws InputError.
ModelFile recorded_model_file(const Manifest& manifest);

// The plant with the recorded step size, seed and kernel. Throws RecordingError (without a path) if this program
// makes other signals of it, or if this processor lacks the kernel and `any_kernel` is false.
plant::Model rebuild_model(const Manifest& manifest, bool any_kernel);

// `file` as the recorded run would have built it: the recorded options, step size, seed and kernel.
plant::Model build_as_recorded(ModelFile& file, const Manifest& manifest);

}  // namespace shiftrig::io
