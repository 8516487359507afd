#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "io/model_file.h"
#include "io/scenario_file.h"

namespace shiftrig::io {
namespace {

nlohmann::ordered_json committed(const std::string& name) {
    std::ifstream file(SHIFTRIG_SOURCE_DIR "/config/schema/" + name);
    return nlohmann::ordered_json::parse(file);
}

// Remake them with `shiftrig check --schema model` and `--schema scenario`.
TEST(Schema, TheCommittedSchemasAreThoseOfTheReaders) {
    EXPECT_EQ(committed("model.schema.json"), model_schema());
    EXPECT_EQ(committed("scenario.schema.json"), scenario_schema());
}

TEST(Schema, SaysWhatTheReaderChecks) {
    const auto schema = model_schema();
    const auto& shaft = schema["properties"]["shafts"]["additionalProperties"];
    EXPECT_EQ(shaft["additionalProperties"], false);
    EXPECT_EQ(shaft["required"],
              nlohmann::ordered_json({"a", "b", "stiffness_nm_per_rad", "damping_nm_s_per_rad"}));
    EXPECT_EQ(shaft["properties"]["stiffness_nm_per_rad"]["exclusiveMinimum"], 0);
    EXPECT_EQ(shaft["properties"]["damping_nm_s_per_rad"]["minimum"], 0);
    const auto& gear = schema["properties"]["gears"]["additionalProperties"];
    EXPECT_EQ(gear["oneOf"].size(), 3u);
    EXPECT_EQ(gear["oneOf"][1]["required"], nlohmann::ordered_json({"teeth_a", "teeth_b"}));
}

}  // namespace
}  // namespace shiftrig::io
