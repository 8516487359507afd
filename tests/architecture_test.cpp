// The dependency rule of docs/architecture.md, held against the includes as they are written.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Include {
    std::string file;
    std::string target;
};

std::vector<Include> includes_of(const std::string& room) {
    std::vector<Include> found;
    const std::regex line_rule(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(SHIFTRIG_SOURCE_DIR) / room)) {
        const auto extension = entry.path().extension();
        if (extension != ".h" && extension != ".cpp") continue;
        std::ifstream in(entry.path());
        for (std::string line; std::getline(in, line);) {
            std::smatch match;
            if (std::regex_search(line, match, line_rule)) found.push_back({entry.path().string(), match[1]});
        }
    }
    return found;
}

const std::set<std::string> rooms = {"plant", "rt", "io", "lcmtypes", "analysis", "apps", "tests", "bench"};

const std::map<std::string, std::set<std::string>> may_lean_on = {
    {"plant", {"plant"}},
    {"rt", {"rt"}},
    {"io", {"io", "plant", "lcmtypes"}},
    {"analysis", {"analysis", "io", "plant"}},
    {"apps", {"apps", "analysis", "io", "plant", "rt", "lcmtypes"}},
};

TEST(Architecture, RoomsLeanOnlyOnTheRoomsBelowThem) {
    for (const auto& [room, allowed] : may_lean_on)
        for (const auto& include : includes_of(room)) {
            const std::string target = include.target.substr(0, include.target.find('/'));
            if (rooms.count(target) == 0) continue;
            EXPECT_TRUE(allowed.count(target) == 1) << include.file << " includes " << include.target;
        }
}

TEST(Architecture, PlantKnowsNoClockThreadFileOrSocket) {
    const std::regex forbidden(
        R"(^(thread|mutex|chrono|atomic|fstream|iostream|filesystem|condition_variable|future|linux/|sys/|netinet/|lcm/|yaml-cpp/).*)");
    for (const auto& include : includes_of("plant"))
        EXPECT_FALSE(std::regex_match(include.target, forbidden))
            << include.file << " includes " << include.target;
}

TEST(Architecture, PlantAndTimeDispatchNothingThroughVirtualFunctions) {
    const std::regex word(R"(\bvirtual\b)"), text(R"("[^"]*")");
    for (const std::string room : {"plant", "rt"})
        for (const auto& entry : fs::recursive_directory_iterator(fs::path(SHIFTRIG_SOURCE_DIR) / room)) {
            if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
            std::ifstream in(entry.path());
            int number = 0;
            for (std::string line; std::getline(in, line);) {
                ++number;
                const std::string code = std::regex_replace(line.substr(0, line.find("//")), text, "");
                EXPECT_FALSE(std::regex_search(code, word)) << entry.path().string() << ":" << number;
            }
        }
}

}  // namespace
