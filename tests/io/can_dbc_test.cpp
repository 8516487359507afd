#include <gtest/gtest.h>

#include <string>

#include "io/can/dbc.h"
#include "io/input_error.h"

namespace shiftrig::io::can::dbc {
namespace {

std::string error_of(const std::string& text) {
    try {
        parse(text, "x.dbc");
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

const char* const kEverything =
    "VERSION \"1.0\"\r\n\r\nNS_ :\r\n\tNS_DESC_\r\n\tCM_\r\n\tBA_DEF_\r\n\r\nBS_:\r\n\r\n"
    "BU_: Tcu Rig\r\n"
    "VAL_TABLE_ OnOff 1 \"on\" 0 \"off\" ;\r\n\r\n"
    "BO_ 2566844672 Ccvs: 8 Rig\r\n"
    " SG_ Speed : 8|16@1+ (0.00390625,0) [0|250.996] \"km/h\" Tcu\r\n"
    " SG_ Torque : 39|12@0- (0.5,-10) [0|0] \"Nm\" Tcu,Vector__XXX\r\n\r\n"
    "BO_ 291 Muxed: 8 Tcu\r\n"
    " SG_ Page M : 0|8@1+ (1,0) [0|255] \"\" Rig\r\n"
    " SG_ A m0 : 8|32@1- (1,0) [0|0] \"\" Rig\r\n"
    " SG_ B m1 : 8|16@1+ (1,0) [0|0] \"\" Rig\r\n\r\n"
    "BO_ 292 Nested: 8 Vector__XXX\r\n"
    " SG_ Outer M : 0|4@1+ (1,0) [0|15] \"\" Rig\r\n"
    " SG_ Inner m3M : 4|4@1+ (1,0) [0|15] \"\" Rig\r\n"
    " SG_ Deep m2 : 8|8@1+ (1,0) [0|0] \"\" Rig\r\n\r\n"
    "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\r\n"
    " SG_ Orphan : 0|8@1+ (1,0) [0|0] \"\" Vector__XXX\r\n\r\n"
    "BO_TX_BU_ 291 : Tcu,Rig;\r\n"
    "EV_ Ambient: 0 [-40|80] \"degC\" 20 1 DUMMY_NODE_VECTOR0 Tcu;\r\n"
    "CM_ \"the bus; with \\\"quotes\\\"\r\nand a second line\";\r\n"
    "CM_ BU_ Tcu \"controller\";\r\nCM_ BO_ 291 \"pages\";\r\n"
    "CM_ SG_ 2566844672 Speed \"Geschwindigkeit in m\xFChsam\";\r\n"
    "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\r\n"
    "BA_DEF_ BO_ \"VFrameFormat\" ENUM \"Standard\",\"Extended\",\"J1939PG\";\r\n"
    "BA_DEF_ SG_ \"SPN\" INT 0 524287;\r\nBA_DEF_ \"BusType\" STRING;\r\n"
    "BA_DEF_ SG_ \"SystemSignalLongSymbol\" STRING;\r\n"
    "BA_DEF_REL_ BU_SG_REL_ \"Unknown\" INT 0 1;\r\n"
    "BA_DEF_DEF_ \"GenMsgCycleTime\" 200;\r\nBA_ \"BusType\" \"CAN\";\r\n"
    "BA_ \"GenMsgCycleTime\" BO_ 2566844672 100;\r\nBA_ \"VFrameFormat\" BO_ 2566844672 2;\r\n"
    "BA_ \"SPN\" SG_ 2566844672 Speed 84;\r\n"
    "BA_ \"SystemSignalLongSymbol\" SG_ 291 A \"ASignalWhoseNameIsLongerThanThirtyTwoCharacters\";\r\n"
    "VAL_ 291 Page 0 \"first\" 1 \"second\" ;\r\nVAL_ 291 Gone 0 \"x\" ;\r\n"
    "SIG_GROUP_ 291 Pair 1 : Page A;\r\n"
    "SIG_VALTYPE_ 291 A : 1;\r\n"
    "SG_MUL_VAL_ 292 Deep Inner 2-2, 5-7;\r\n"
    "FUTURE_ 1 2 \"BO_ in a string\" 3;\r\n";

TEST(Dbc, ReadsWhatRealFilesHold) {
    const Database db = parse(kEverything, "x.dbc");
    EXPECT_EQ(db.version, "1.0");
    ASSERT_EQ(db.nodes.size(), 2U);
    EXPECT_EQ(db.nodes[0].comment, "controller");
    ASSERT_EQ(db.messages.size(), 3U);
    EXPECT_EQ(db.comment, "the bus; with \"quotes\"\nand a second line");
    EXPECT_EQ(db.attributes.at("BusType"), "CAN");
    ASSERT_EQ(db.environment.size(), 1U);
    EXPECT_EQ(db.environment[0].initial, 20);

    const Message& ccvs = *db.find("Ccvs");
    EXPECT_TRUE(ccvs.extended);
    EXPECT_EQ(ccvs.id, 0x18FEF100U);
    EXPECT_EQ(ccvs.transmitter, "Rig");
    EXPECT_EQ(ccvs.cycle_time_ms(), 100);
    EXPECT_EQ(ccvs.attributes.at("VFrameFormat"), "J1939PG");
    const Signal& speed = *ccvs.find("Speed");
    EXPECT_EQ(speed.start_bit, 8);
    EXPECT_EQ(speed.length, 16);
    EXPECT_TRUE(speed.little_endian);
    EXPECT_EQ(speed.factor, 0.00390625);
    EXPECT_EQ(speed.unit, "km/h");
    EXPECT_EQ(speed.attributes.at("SPN"), "84");
    EXPECT_EQ(speed.comment, "Geschwindigkeit in m\xC3\xBChsam");
    const Signal& torque = *ccvs.find("Torque");
    EXPECT_FALSE(torque.little_endian);
    EXPECT_TRUE(torque.is_signed);
    EXPECT_EQ(torque.offset, -10);
    EXPECT_EQ(torque.receivers, std::vector<std::string>{"Tcu"});

    const Message& muxed = *db.find("Muxed");
    EXPECT_FALSE(muxed.extended);
    EXPECT_EQ(muxed.cycle_time_ms(), 200);  // the default
    EXPECT_EQ(muxed.comment, "pages");
    EXPECT_EQ(muxed.other_transmitters, std::vector<std::string>{"Rig"});
    EXPECT_EQ(muxed.groups.size(), 1U);
    EXPECT_TRUE(muxed.find("Page")->is_multiplexor);
    EXPECT_EQ(muxed.find("Page")->value_names[1].second, "second");
    const Signal* renamed = muxed.find("ASignalWhoseNameIsLongerThanThirtyTwoCharacters");
    ASSERT_TRUE(renamed);
    EXPECT_EQ(renamed->type, ValueType::float32);
    EXPECT_EQ(renamed->multiplexor, "Page");
    EXPECT_EQ(renamed->selected_by[0].first, 0U);

    const Signal& deep = *db.find("Nested")->find("Deep");
    EXPECT_EQ(deep.multiplexor, "Inner");
    ASSERT_EQ(deep.selected_by.size(), 2U);
    EXPECT_EQ(deep.selected_by[1], (std::pair<std::uint64_t, std::uint64_t>{5, 7}));
    EXPECT_EQ(db.find("Nested")->find("Inner")->multiplexor, "Outer");

    ASSERT_EQ(db.warnings.size(), 1U);
    EXPECT_EQ(db.warnings[0], "x.dbc:50: VAL_ speaks of Muxed.Gone, which is not defined");
}

TEST(Dbc, NamesFileLineAndColumnOfWhatIsBroken) {
    EXPECT_EQ(error_of("BU_: A\nBO_ 1 M: 8 A\n SG_ S : 0|8@1 (1,0) [0|0] \"\" A\n"),
              "x.dbc:3:16: \"+\" is wanted, found \"(\"");
    EXPECT_EQ(error_of("BO_ 1 M: 8 A\n SG_ S : 60|8@1+ (1,0) [0|0] \"\" A\n"),
              "x.dbc:2: signal M.S: bits 60|8 reach beyond the message's 8 bytes");
    EXPECT_EQ(error_of("BO_ 1 M: 8 A\n SG_ S : 7|65@0+ (1,0) [0|0] \"\" A\n"),
              "x.dbc:2:12: signal length must be 1…64, found \"65\"");
    EXPECT_EQ(error_of("BO_ 1 M: 2 A\n SG_ S : 3|13@0+ (1,0) [0|0] \"\" A\n"),
              "x.dbc:2: signal M.S: bits 3|13 reach beyond the message's 2 bytes");
    EXPECT_EQ(error_of("BO_ 1 M: 8 A\n\nBO_ 1 N: 8 A\n"),
              "x.dbc:3: message N: identifier 1 is taken by M in line 1");
    EXPECT_EQ(error_of("BO_ 5000 M: 8 A\n"),
              "x.dbc:1: message M: identifier 5000 has more than 11 bits and is not marked as extended");
    EXPECT_EQ(error_of("BO_ 1 M: 8 A\n SG_ S : 0|8@1+ (0,0) [0|0] \"\" A\n"),
              "x.dbc:2: signal M.S: factor 0");
    EXPECT_EQ(error_of("CM_ \"never\nends"), "x.dbc:1: a string begins here and never ends");
    EXPECT_EQ(error_of("SG_ S : 0|8@1+ (1,0) [0|0] \"\" A\n"),
              "x.dbc:1:1: a signal stands outside of a message, found \"SG_\"");
    EXPECT_EQ(error_of("BO_ 1 M: 8 A\n SG_ S m0 : 0|8@1+ (1,0) [0|0] \"\" A\n"),
              "x.dbc:2: signal M.S is multiplexed, but M has 0 multiplexors to choose from");
    EXPECT_EQ(error_of("BO_ 1 M: 8 A\n SG_ S : 0|8@1+ (1,0) [0|0] \"\" A\nSIG_VALTYPE_ 1 S : 1;\n"),
              "x.dbc:3: signal S is a float of 32 bits but has 8");
    EXPECT_EQ(error_of("BO_ 1 M"), "x.dbc:1:8: \":\" is wanted, the file ends");
}

TEST(Dbc, TheShippedFileHoldsEveryGroupWithItsIdentifierCycleAndSpns) {
    const Database db = read(SHIFTRIG_SOURCE_DIR "/config/can/shiftrig.dbc");
    EXPECT_TRUE(db.warnings.empty());
    struct Expected {
        const char* name;
        std::uint32_t id;
        double cycle_ms;
    };
    for (const Expected& expected : {Expected{"EEC1", 0x0CF00400, 20},
                                     {"EEC2", 0x0CF00300, 50},
                                     {"ETC1", 0x0CF00203, 10},
                                     {"ETC2", 0x18F00503, 100},
                                     {"TC1", 0x0C010305, 50},
                                     {"TSC1", 0x0C000003, 10},
                                     {"CCVS1", 0x18FEF100, 100},
                                     {"EBC1", 0x18F0010B, 100},
                                     {"TRF1", 0x18FEF880, 1000},
                                     {"WBSD", 0x0CFE48F0, 100},
                                     {"GBSD", 0x0CFE49F0, 100},
                                     {"ClutchCommandA", 0x18FF1003, 10},
                                     {"ClutchCommandB", 0x18FF1103, 10},
                                     {"ClutchCommandC", 0x18FF1203, 10},
                                     {"ClutchFeedbackA", 0x18FF2080, 10},
                                     {"ClutchFeedbackB", 0x18FF2180, 10},
                                     {"ClutchFeedbackC", 0x18FF2280, 10},
                                     {"ShaftSpeedsA", 0x18FF3080, 10},
                                     {"ShaftSpeedsB", 0x18FF3180, 10}}) {
        const Message* message = db.find(expected.name);
        ASSERT_TRUE(message) << expected.name;
        EXPECT_EQ(message->id, expected.id) << expected.name;
        EXPECT_TRUE(message->extended);
        EXPECT_EQ(message->length, 8);
        EXPECT_EQ(message->cycle_time_ms(), expected.cycle_ms) << expected.name;
    }
    EXPECT_EQ(db.find("EEC1")->find("EngineSpeed")->attributes.at("SPN"), "190");
    EXPECT_EQ(db.find("ETC1")->find("OutputShaftSpeed")->attributes.at("SPN"), "191");
    EXPECT_EQ(db.messages.size(), 19U);
}

}  // namespace
}  // namespace shiftrig::io::can::dbc
