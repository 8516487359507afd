#include "io/recording/rebuild.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace shiftrig::io {

namespace {

plant::KernelKind kernel_of(const std::string& name) {
    if (name == "portable") return plant::KernelKind::portable;
    if (name == "avx2") return plant::KernelKind::avx2;
    if (name == "avx512") return plant::KernelKind::avx512;
    return plant::KernelKind::automatic;
}

void require_same(const char* what, const std::vector<plant::Signal>& recorded,
                  const std::vector<plant::Signal>& built) {
    const auto name = [](const std::vector<plant::Signal>& signals, std::size_t i) {
        return i < signals.size() ? "\"" + signals[i].name + "\"" : std::string("missing");
    };
    for (std::size_t i = 0; i < std::max(recorded.size(), built.size()); ++i)
        if (name(recorded, i) != name(built, i))
            throw RecordingError("was made by a program with other signals: " + std::string(what) + " " +
                                 std::to_string(i) + " is " + name(recorded, i) + " there, " +
                                 name(built, i) + " here");
}

// In another model than the recorded one they may be missing.
void use_recorded_options(ModelFile& file, const Manifest& manifest) {
    try {
        for (const auto& [gear, option] : manifest.overrides) select_option(file.description, gear, option);
    } catch (const std::invalid_argument& error) {
        throw InputError(file.path, 0, 0, std::string(error.what()) + ", which the recorded run has in use");
    }
}

}  // namespace

ModelFile recorded_model_file(const Manifest& manifest) {
    ModelFile file = parse_model(manifest.model_text, manifest.model_path);
    use_recorded_options(file, manifest);
    return file;
}

plant::Model build_as_recorded(ModelFile& file, const Manifest& manifest) {
    use_recorded_options(file, manifest);
    plant::BuildOptions options;
    options.step_size = manifest.step_size;
    options.kernel = kernel_of(manifest.kernel);
    options.seed = manifest.seed;
    return build_model(file, options);
}

plant::Model rebuild_model(const Manifest& manifest, bool any_kernel) {
    ModelFile file = recorded_model_file(manifest);
    plant::Model model = build_as_recorded(file, manifest);
    require_same("input", manifest.inputs, model.inputs());
    require_same("output", manifest.outputs, model.outputs());
    if (model.state_size() != manifest.initial_state.size())
        throw RecordingError("was made by a program whose state has " +
                             std::to_string(manifest.initial_state.size()) + " bytes; it has " +
                             std::to_string(model.state_size()) + " here");
    if (!any_kernel && model.kernel() != manifest.kernel)
        throw RecordingError("was made with kernel " + manifest.kernel +
                             ", which this processor lacks (it has " + std::string(model.kernel()) +
                             "); compare with --tolerance");
    return model;
}

}  // namespace shiftrig::io
