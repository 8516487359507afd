#include "analysis/junit.h"

#include <cstdio>

namespace shiftrig::analysis {

namespace {

// Text that XML 1.0 can hold: markup escaped, control characters replaced.
std::string escaped(const std::string& text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
            case '&':
                result += "&amp;";
                break;
            case '<':
                result += "&lt;";
                break;
            case '>':
                result += "&gt;";
                break;
            case '"':
                result += "&quot;";
                break;
            case '\n':
                result += "&#10;";
                break;
            default:
                result += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
        }
    }
    return result;
}

std::string seconds(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3f", value);
    return text;
}

}  // namespace

std::string junit_xml(const std::vector<TestResult>& results) {
    int failures = 0, errors = 0;
    double time = 0;
    for (const auto& result : results) {
        errors += result.error.empty() ? 0 : 1;
        failures += result.error.empty() && !result.failures.empty() ? 1 : 0;
        time += result.wall_time_s;
    }
    const std::string totals = " tests=\"" + std::to_string(results.size()) + "\" failures=\"" +
                               std::to_string(failures) + "\" errors=\"" + std::to_string(errors) +
                               "\" time=\"" + seconds(time) + "\"";
    std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites" + totals +
                      ">\n  <testsuite name=\"shiftrig\"" + totals + ">\n";
    for (const auto& result : results) {
        xml += "    <testcase classname=\"scenario\" name=\"" + escaped(result.name) + "\" file=\"" +
               escaped(result.file) + "\" time=\"" + seconds(result.wall_time_s) + "\"";
        if (result.passed()) {
            xml += "/>\n";
            continue;
        }
        xml += ">\n";
        if (!result.error.empty()) xml += "      <error message=\"" + escaped(result.error) + "\"/>\n";
        if (!result.failures.empty()) {
            xml += "      <failure message=\"" + escaped(result.failures.front()) + "\">";
            for (const auto& line : result.failures) xml += escaped(line) + "\n";
            xml += "</failure>\n";
        }
        xml += "    </testcase>\n";
    }
    return xml + "  </testsuite>\n</testsuites>\n";
}

}  // namespace shiftrig::analysis
