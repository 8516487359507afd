// What `shiftrig check` finds out about a machine, as JSON and in words.
#pragma once

#include <Eigen/Core>
#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "io/model_file.h"
#include "plant/modal.h"

namespace shiftrig::cli {

struct Examination {
    struct Gear {
        plant::GearVariant variant;
        plant::ModalResult modal;
    };
    // What happens where one more clutch or brake is closed than a gear path closes.
    struct TieUp {
        std::string gear;                 // path
        std::string with;                 // the one more; empty: the path itself
        bool blocks = false;              // the output cannot move
        std::vector<plant::TieUp> loops;  // of the path, or what the one more closes
    };
    plant::Description machine;
    std::string engine, engine_reason;         // how a step is integrated: etd3, ark3; why so
    std::vector<std::string> masses, devices;  // rows and columns of the distribution matrix
    Eigen::MatrixXd distribution;              // [Algin] SDM: one column per device
    std::vector<Gear> gears;
    plant::ModalResult open;   // every clutch and brake open
    std::vector<Gear> states;  // others that are looked at, the open one among them
    std::vector<TieUp> tie_ups;
    std::vector<std::string> warnings;
};

// For steps of this size [s]. Throws io::InputError.
Examination examine(const io::ModelFile& file, double step_size);

nlohmann::ordered_json as_json(const Examination& examination);
void print(std::ostream& out, const Examination& examination, bool with_shapes);

}  // namespace shiftrig::cli
