#include "io/model_file.h"

namespace shiftrig::io {

plant::Model build_model(const ModelFile& file, const plant::BuildOptions& options) {
    try {
        return plant::Model::build(file.description, options);
    } catch (const plant::ModelError& error) {
        throw located(file, error);
    }
}

}  // namespace shiftrig::io
