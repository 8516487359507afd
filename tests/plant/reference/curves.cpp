#include "tests/plant/reference/curves.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace shiftrig::reference {

Curves read_curves(const std::string& path) {
    std::ifstream file(path);
    if (!file) throw std::runtime_error("cannot read " + path);
    std::string line, cell;
    std::getline(file, line);
    std::vector<std::string> names;
    for (std::istringstream header(line); std::getline(header, cell, ',');) names.push_back(cell);
    Curves curves;
    while (std::getline(file, line)) {
        std::istringstream row(line);
        for (const auto& name : names) {
            std::getline(row, cell, ',');
            curves.column[name].push_back(std::stod(cell));
        }
    }
    return curves;
}

}  // namespace shiftrig::reference
