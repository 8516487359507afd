#include "analysis/junit.h"

#include <gtest/gtest.h>

namespace {

using namespace shiftrig::analysis;

TEST(Junit, CountsFailuresAndErrorsAndEscapesTheirText) {
    TestResult good, bad, broken;
    good.name = "good";
    good.file = "good.yaml";
    good.wall_time_s = 0.25;
    bad.name = "bad";
    bad.failures = {"s.yaml:1:2: a < b & \"c\"", "second"};
    broken.name = "broken";
    broken.error = "cannot be read\x01";
    EXPECT_EQ(junit_xml({good, bad, broken}),
              "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
              "<testsuites tests=\"3\" failures=\"1\" errors=\"1\" time=\"0.250\">\n"
              "  <testsuite name=\"shiftrig\" tests=\"3\" failures=\"1\" errors=\"1\" time=\"0.250\">\n"
              "    <testcase classname=\"scenario\" name=\"good\" file=\"good.yaml\" time=\"0.250\"/>\n"
              "    <testcase classname=\"scenario\" name=\"bad\" file=\"\" time=\"0.000\">\n"
              "      <failure message=\"s.yaml:1:2: a &lt; b &amp; &quot;c&quot;\">s.yaml:1:2: a &lt; b "
              "&amp; &quot;c&quot;\n"
              "second\n"
              "</failure>\n"
              "    </testcase>\n"
              "    <testcase classname=\"scenario\" name=\"broken\" file=\"\" time=\"0.000\">\n"
              "      <error message=\"cannot be read?\"/>\n"
              "    </testcase>\n"
              "  </testsuite>\n"
              "</testsuites>\n");
}

}  // namespace
