// Reference curves in tests/data: a header line, then one row a millisecond.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace shiftrig::reference {

struct Curves {
    std::map<std::string, std::vector<double>> column;
    const std::vector<double>& operator[](const std::string& name) const { return column.at(name); }
};

Curves read_curves(const std::string& path);  // throws std::runtime_error

}  // namespace shiftrig::reference
