// The rig as a citizen of a J1939 network: addresses, requests, faults, long messages.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <numeric>

#include "io/can/inprocess.h"
#include "io/can/j1939.h"
#include "io/can/link.h"
#include "tests/io/can_rig_signals.h"
#include "tests/io/count_allocations.h"

namespace shiftrig::io::can {
namespace {

constexpr std::int64_t kMs = 1'000'000;

// The rig on a bus with one other node, played by hand.
struct Network : testing::Test {
    explicit Network(AddressClaim mode = AddressClaim::claim)
        : link(mapping, bus.end(0), table, {.role = Role::rig, .address_claim = mode}) {}

    // Runs the rig for some milliseconds and keeps what the other node hears.
    void run(int ms) {
        std::array<Frame, 64> frames;
        for (const int end = now_ms + ms; now_ms < end; ++now_ms) {
            link.receive(now_ms * kMs, table);
            link.send(now_ms * kMs, table);
            const std::size_t count = bus.end(1).receive(now_ms * kMs, frames);
            for (std::size_t i = 0; i < count; ++i) heard.emplace_back(frames[i]);
        }
    }
    void say(std::uint32_t id, std::initializer_list<int> bytes) {
        Frame frame;
        frame.id = id;
        frame.extended = true;
        frame.length = static_cast<std::uint8_t>(bytes.size());
        std::transform(bytes.begin(), bytes.end(), frame.data.begin(),
                       [](int b) { return static_cast<std::uint8_t>(b); });
        bus.end(1).send(now_ms * kMs, frame);
    }
    void say_claim(std::uint8_t address, std::uint64_t name) {
        Frame frame;
        frame.id = 0x18EEFF00U | address;
        frame.extended = true;
        frame.length = 8;
        for (std::size_t i = 0; i < 8; ++i) frame.data[i] = static_cast<std::uint8_t>(name >> (8 * i));
        bus.end(1).send(now_ms * kMs, frame);
    }
    std::vector<Frame> of(std::uint32_t id) const {
        std::vector<Frame> found;
        for (const auto& frame : heard)
            if (frame.id == id) found.push_back(frame);
        return found;
    }
    static std::string bytes(const Frame& frame) {
        std::string text;
        for (std::size_t i = 0; i < frame.length; ++i) {
            char hex[4];
            std::snprintf(hex, sizeof hex, "%02X", frame.data[i]);
            text += hex;
        }
        return text;
    }

    Mapping mapping = tractor_mapping();
    InProcessBus bus{2};
    SignalTable table = rig_signals();
    CanLink link;
    std::vector<Frame> heard;
    int now_ms = 0;
};

struct SettledNetwork : Network {
    SettledNetwork() : Network(AddressClaim::settled) {}
};

TEST(Name, HoldsItsFieldsAtThePlacesOfTheStandard) {
    j1939::Name name;
    name.identity = 0x1ABCDE;
    name.manufacturer = 0x5A5;
    name.ecu_instance = 5;
    name.function_instance = 17;
    name.function = 0x83;
    name.vehicle_system = 0x55;
    name.vehicle_system_instance = 9;
    name.industry_group = 2;
    name.arbitrary_address = true;
    const std::uint64_t bits = name.bits();
    EXPECT_EQ(bits & 0x1FFFFF, 0x1ABCDEU);
    EXPECT_EQ((bits >> 21) & 0x7FF, 0x5A5U);
    EXPECT_EQ((bits >> 32) & 7, 5U);
    EXPECT_EQ((bits >> 35) & 31, 17U);
    EXPECT_EQ((bits >> 40) & 0xFF, 0x83U);
    EXPECT_EQ((bits >> 48) & 1, 0U);
    EXPECT_EQ((bits >> 49) & 0x7F, 0x55U);
    EXPECT_EQ((bits >> 56) & 15, 9U);
    EXPECT_EQ((bits >> 60) & 7, 2U);
    EXPECT_EQ(bits >> 63, 1U);
}

TEST_F(Network, EveryAddressPlayedIsClaimedAndThoseOf128To247WaitBeforeTheySpeak) {
    run(250);
    for (const std::uint32_t address : {0x00U, 0x05U, 0x0BU, 0x80U, 0xF0U})
        EXPECT_EQ(of(0x18EEFF00U | address).size(), 1U) << address;
    EXPECT_TRUE(of(0x18EEFF03).empty()) << "the controller's address is not ours";
    EXPECT_FALSE(of(0x0CF00400).empty()) << "the engine speaks at once";
    EXPECT_TRUE(of(0x18FF2080).empty()) << "the sensors wait";
    EXPECT_EQ(value(table, "bus.TransmissionSensors.address"), 0);
    run(20);
    EXPECT_FALSE(of(0x18FF2080).empty());
    EXPECT_EQ(value(table, "bus.TransmissionSensors.address"), 1);
}

TEST_F(Network, AWeakerClaimIsAnsweredWithOurOwnAndAStrongerOneTakesTheAddress) {
    run(300);
    heard.clear();
    say_claim(0x80, ~std::uint64_t{0});
    run(20);
    EXPECT_EQ(of(0x18EEFF80).size(), 1U) << "defended";
    EXPECT_FALSE(of(0x18FF2080).empty());

    heard.clear();
    say_claim(0x80, 0);
    run(200);
    EXPECT_EQ(of(0x18EEFFFE).size(), 1U) << "cannot claim";
    EXPECT_TRUE(of(0x18FF2080).empty()) << "a lost address is silent";
    EXPECT_FALSE(of(0x0CF00400).empty()) << "the others are not concerned";
    EXPECT_EQ(value(table, "bus.TransmissionSensors.address"), 2);
}

TEST_F(SettledNetwork, SettledAddressesSpeakFromTheStartAndAreDefendedAllTheSame) {
    run(10);
    EXPECT_TRUE(of(0x18EEFF80).empty());
    EXPECT_FALSE(of(0x18FF2080).empty());
    say_claim(0x80, ~std::uint64_t{0});
    run(5);
    EXPECT_EQ(of(0x18EEFF80).size(), 1U);
}

TEST_F(SettledNetwork, RequestsAreAnsweredAndWhatWeDoNotHaveIsRefused) {
    run(5);
    heard.clear();
    run(100);
    const auto by_itself = of(0x18FEF100).size();  // CCVS1 in its own cycle of 100 ms
    heard.clear();
    say(0x18EA00F9, {0xF1, 0xFE, 0x00});  // engine, send CCVS1 (65265)
    say(0x18EA80F9, {0x00, 0xEE, 0x00});  // sensors, who are you
    say(0x18EA05F9, {0xDD, 0xFE, 0x00});  // shift console, send turbocharger speed (65245)
    run(100);
    EXPECT_EQ(of(0x18FEF100).size(), by_itself + 1);
    EXPECT_EQ(of(0x18EEFF80).size(), 1U);
    ASSERT_EQ(of(0x18E8FF05).size(), 1U);
    EXPECT_EQ(bytes(of(0x18E8FF05)[0]), "01FFFFFFF9DDFE00");

    heard.clear();
    say(0x18EAFFF9, {0x00, 0xEE, 0x00});  // everybody: who are you
    say(0x18EAFFF9, {0xDD, 0xFE, 0x00});  // to everybody: nobody refuses
    run(3);
    int claims = 0;
    for (const auto& frame : heard) claims += (frame.id & 0xFFFFFF00U) == 0x18EEFF00U;
    EXPECT_EQ(claims, 5);
    EXPECT_TRUE(of(0x18E8FF05).empty());
}

TEST_F(SettledNetwork, EveryNodeThatMayHaveTroublesSaysOnceASecondThatItHasNone) {
    run(3000);
    for (const std::uint32_t address : {0x00U, 0x80U, 0xF0U}) {
        const auto told = of(0x18FECA00U | address);
        ASSERT_EQ(told.size(), 3U) << address;
        for (const auto& frame : told) EXPECT_EQ(bytes(frame), "00FF00000000FFFF");
        EXPECT_EQ(told[2].timestamp_ns - told[1].timestamp_ns, 1000 * kMs);
    }
    EXPECT_TRUE(of(0x18FECA05).empty()) << "the shift console has none of the mapping's codes";
}

TEST_F(SettledNetwork, ASensorThatFallsSilentIsToldAtOnceByItsOwnerWithItsLampAndGoneWhenItIsBack) {
    run(310);
    heard.clear();
    value(table, "sensor.output.dropout") = 1;
    run(2000);
    const auto told = of(0x18FECA80);
    ASSERT_EQ(told.size(), 2U);
    EXPECT_EQ(told[0].timestamp_ns, 310 * kMs);
    EXPECT_EQ(told[1].timestamp_ns, 1310 * kMs);
    // amber lamp; SPN 191 = 0xBF with FMI 5; first occurrence
    EXPECT_EQ(bytes(told[0]), "04FFBF000501FFFF");
    for (const auto& frame : of(0x18FECA00))
        EXPECT_EQ(bytes(frame), "00FF00000000FFFF") << "not the engine's";

    value(table, "sensor.output.dropout") = 0;
    heard.clear();
    run(1);
    ASSERT_EQ(of(0x18FECA80).size(), 1U);
    EXPECT_EQ(bytes(of(0x18FECA80)[0]), "00FF00000000FFFF");
}

TEST_F(SettledNetwork, AnSpnOfNineteenBitsKeepsItsUppermostThreeAboveTheFmi) {
    value(table, "clutch.FR.valve_stuck") = 1;
    run(1);
    // SPN 520215 = 0x7F017: low byte 17, then F0, then 7 << 5 with FMI 7
    ASSERT_EQ(of(0x18FECA80).size(), 1U);
    EXPECT_EQ(bytes(of(0x18FECA80)[0]), "04FF17F0E701FFFF");
}

TEST_F(SettledNetwork, AFlickeringTroubleChangesAtMostOnceASecondAndEveryOccurrenceIsCounted) {
    run(500);
    heard.clear();
    for (int i = 0; i < 200; ++i) {  // 10 ms on, 10 ms off
        value(table, "engine.engine.stalled") = i % 2;
        run(10);
    }
    const auto told = of(0x18FECA00);
    ASSERT_LE(told.size(), 6U) << "in two seconds";
    ASSERT_GE(told.size(), 2U);
    EXPECT_EQ(bytes(told[0]), "10FFBE000101FFFF") << "red lamp, SPN 190, FMI 1";
    std::vector<std::int64_t> changed;
    for (std::size_t i = 0; i < told.size(); ++i)
        if (i == 0 || told[i].data[0] != told[i - 1].data[0]) changed.push_back(told[i].timestamp_ns);
    for (std::size_t i = 1; i < changed.size(); ++i) EXPECT_GE(changed[i] - changed[i - 1], 1000 * kMs);
    ASSERT_EQ(link.troubles().size(), 1U);
    EXPECT_EQ(link.troubles()[0].occurrences, 100U);
    heard.clear();
    value(table, "engine.engine.stalled") = 0;
    run(1100);
    EXPECT_EQ(bytes(of(0x18FECA00).back()), "00FF00000000FFFF") << "the last state is told in the end";
}

TEST_F(SettledNetwork, AHotClutchWarnsAndThenFailsAndColdOilIsSaidToo) {
    const auto dm1 = [this] {
        heard.clear();
        run(1000);
        return of(0x18FECA80).empty() ? "" : bytes(of(0x18FECA80).back());
    };
    value(table, "clutch.F3.temperature") = 210;
    EXPECT_EQ(dm1(), "04FF0BF0F001FFFF") << "SPN 520203 FMI 16, amber";
    value(table, "clutch.F3.temperature") = 260;
    EXPECT_EQ(dm1(), "10FF0BF0E001FFFF") << "FMI 0 instead, red";
    value(table, "clutch.F3.temperature") = 90;
    value(table, "oil.temperature") = -10;
    EXPECT_EQ(dm1(), "04FFB1001101FFFF") << "SPN 177 FMI 17";
    value(table, "oil.temperature") = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(dm1(), "00FF00000000FFFF");
}

TEST_F(SettledNetwork, SeveralTroublesTravelAsAnAnnouncedMessageAndLightTheLampsOfAll) {
    run(20);
    heard.clear();
    value(table, "sensor.input.stuck") = 1;
    value(table, "clutch.F1.temperature") = 300;
    run(300);
    const auto announced = of(0x1CECFF80), packets = of(0x1CEBFF80);
    ASSERT_EQ(announced.size(), 1U);
    EXPECT_EQ(announced[0].timestamp_ns, 20 * kMs) << "at once";
    EXPECT_EQ(bytes(announced[0]), "200A0002FFCAFE00");
    ASSERT_EQ(packets.size(), 2U);
    EXPECT_EQ(bytes(packets[0]),
              "0114FFA1000201"
              "09");
    EXPECT_EQ(bytes(packets[1]),
              "02F0E001"
              "FFFFFFFF");
    EXPECT_GE(packets[1].timestamp_ns - packets[0].timestamp_ns, 50 * kMs);
    EXPECT_TRUE(of(0x18FECA80).empty());
}

// 45 codes of one node are 182 bytes, 26 packets, 1.3 s: longer than the cycle.
TEST_F(SettledNetwork, AListLongerThanASecondCarriesIsToldWithoutPilingUpAndWithoutAllocation) {
    for (int i = 0; i < table.size(); ++i) {
        const auto& name = table.signal(i).name;
        if (name.ends_with("stuck") || name.ends_with("dropout") || name.ends_with("missing_teeth") ||
            name.ends_with(".leak"))
            table.value[static_cast<std::size_t>(i)] = 1;
        if (name.ends_with(".bias")) table.value[static_cast<std::size_t>(i)] = 100;
    }
    heard.reserve(100'000);
    const CountAllocations allocations;
    run(10'000);
    EXPECT_EQ(allocations.count(), 0);
    std::map<int, std::int64_t> last;  // announcements by source
    for (const auto& frame : heard) {
        if ((frame.id & 0xFFFFFF00U) != 0x1CECFF00U || frame.data[0] != 32) continue;
        const int source = static_cast<int>(frame.id & 0xFFU), packets = frame.data[3];
        EXPECT_TRUE(!last.contains(source) || frame.timestamp_ns - last[source] >= packets * 50 * kMs);
        last[source] = frame.timestamp_ns;
    }
    EXPECT_EQ(last.size(), 3U) << "each of the three has its turn";
    EXPECT_GE(last[0x80], 8000 * kMs) << "and is not forgotten";
}

TEST_F(SettledNetwork, AnAskerHearsTheTroublesOfTheOneHeAsks) {
    value(table, "rig.safe_command") = 1;
    run(10);
    heard.clear();
    say(0x18EA80F9, {0xCA, 0xFE, 0x00});
    say(0x18EA05F9, {0xCA, 0xFE, 0x00});
    run(3);
    ASSERT_EQ(of(0x18FECA80).size(), 1U);
    EXPECT_EQ(bytes(of(0x18FECA80)[0]), "04FFD3070901FFFF") << "SPN 2003 FMI 9";
    ASSERT_EQ(of(0x18FECA05).size(), 1U);
    EXPECT_EQ(bytes(of(0x18FECA05)[0]), "00FF00000000FFFF");
}

TEST(TroubleCodes, AConditionMustHoldAsLongAsItsCodeWants) {
    Mapping mapping = tractor_mapping();
    for (auto& code : mapping.troubles) code.after_ms = 50;
    InProcessBus bus(2);
    SignalTable table = rig_signals();
    CanLink link(mapping, bus.end(0), table);
    int now_ms = 0;
    const auto run = [&](int ms) {
        for (const int end = now_ms + ms; now_ms < end; ++now_ms) link.send(now_ms * kMs, table);
    };
    value(table, "sensor.output.stuck") = 1;
    run(50);
    value(table, "sensor.output.stuck") = 0;
    run(10);
    EXPECT_TRUE(link.troubles().empty()) << "49 ms are not enough";
    value(table, "sensor.output.stuck") = 1;
    run(51);
    ASSERT_EQ(link.troubles().size(), 1U);
    EXPECT_TRUE(link.troubles()[0].active);
    EXPECT_EQ(link.troubles()[0].spn, 191U);
    EXPECT_EQ(link.troubles()[0].fmi, 2U);
    EXPECT_EQ(link.troubles()[0].node, "TransmissionSensors");
}

TEST_F(Network, TroublesWaitForTheAddressAndALostOneIsSilent) {
    value(table, "sensor.output.dropout") = 1;
    run(250);
    EXPECT_TRUE(of(0x18FECA80).empty()) << "the sensors have no address yet";
    run(20);
    ASSERT_EQ(of(0x18FECA80).size(), 1U);
    EXPECT_EQ(bytes(of(0x18FECA80)[0]), "04FFBF000501FFFF");
    say_claim(0x80, 0);
    heard.clear();
    run(3000);
    EXPECT_TRUE(of(0x18FECA80).empty());
    EXPECT_EQ(of(0x18FECA00).size(), 3U);
}

TEST_F(SettledNetwork, ALongAnswerToOneAskerIsAConversation) {
    say(0x18EA80F9, {0xDA, 0xFE, 0x00});  // software identification
    run(3);
    ASSERT_EQ(of(0x1CECF980).size(), 1U);
    EXPECT_EQ(bytes(of(0x1CECF980)[0]), "100A0002FFDAFE00");
    run(100);
    EXPECT_TRUE(of(0x1CEBF980).empty()) << "nothing before it is clear to send";
    say(0x1CEC80F9, {0x11, 2, 1, 0xFF, 0xFF, 0xDA, 0xFE, 0x00});
    run(5);
    ASSERT_EQ(of(0x1CEBF980).size(), 2U);
    EXPECT_EQ(bytes(of(0x1CEBF980)[0]), "0101736869667472");
    EXPECT_EQ(bytes(of(0x1CEBF980)[1]), "0269672AFFFFFFFF");
    say(0x1CEC80F9, {0x13, 10, 0, 2, 0xFF, 0xDA, 0xFE, 0x00});
    run(2000);
    EXPECT_EQ(of(0x1CECF980).size(), 1U) << "no abort";

    say(0x18EA80F9, {0xDA, 0xFE, 0x00});
    run(1400);
    ASSERT_EQ(of(0x1CECF980).size(), 3U) << "asked again and left alone: it gives up";
    EXPECT_EQ(of(0x1CECF980)[2].data[0], 255);
    EXPECT_EQ(of(0x1CECF980)[2].data[1], 3);
}

// A controller whose message does not fit into a frame.
TEST(LongMessages, AMappedMessageOfMoreThanEightBytesTravelsByTransportProtocol) {
    const auto folder =
        std::filesystem::temp_directory_path() / ("shiftrig_j1939_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "long.dbc")
        << "BU_: Tcu Rig\nBO_ 2566855683 Long: 20 Tcu\n SG_ P : 128|16@1+ (0.1,0) [0|6425.5] \"kPa\" Rig\n"
           "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\nBA_DEF_DEF_ \"GenMsgCycleTime\" 500;\n";
    std::ofstream(folder / "long.yaml") << "dbc: long.dbc\nrig_nodes: [Rig]\nmessages:\n  Long:\n    "
                                           "signals: {P: clutch.F1.pressure_command}\n";
    const Mapping mapping = read_mapping((folder / "long.yaml").string());
    std::filesystem::remove_all(folder);
    InProcessBus bus(2);
    SignalTable rig = rig_signals(), tcu;
    CanLink rig_link(mapping, bus.end(0), rig),
        tcu_link(mapping, bus.end(1), tcu, {.role = Role::controller});
    value(tcu, "clutch.F1.pressure_command") = 9.87e5;
    int arrived_ms = -1;
    const CountAllocations allocations;
    for (int ms = 0; ms < 400; ++ms) {
        tcu_link.send(ms * kMs, tcu);
        tcu_link.receive(ms * kMs, tcu);
        rig_link.receive(ms * kMs, rig);
        rig_link.send(ms * kMs, rig);
        if (arrived_ms < 0 && rig.value[static_cast<std::size_t>(rig.find("clutch.F1.pressure_command"))] > 0)
            arrived_ms = ms;
    }
    EXPECT_EQ(allocations.count(), 0);
    EXPECT_DOUBLE_EQ(value(rig, "clutch.F1.pressure_command"), 9.87e5);
    EXPECT_GE(arrived_ms, 150) << "three packets, 50 ms before each";
    EXPECT_LE(arrived_ms, 155);
}

TEST(LongMessages, AMissingPacketAnImpossibleLengthOrSilenceEndTheArrival) {
    InProcessBus bus(2);
    j1939::Transport transport;
    const auto ours = [](std::uint8_t address) { return address == 0x80; };
    const auto say = [&](std::uint32_t id, std::initializer_list<int> bytes, std::int64_t now_ns) {
        Frame frame;
        frame.id = id;
        frame.extended = true;
        frame.length = 8;
        std::transform(bytes.begin(), bytes.end(), frame.data.begin(),
                       [](int b) { return static_cast<std::uint8_t>(b); });
        transport.take(frame, now_ns, bus.end(0), ours);
    };
    j1939::LongMessage message;
    say(0x1CECFF03, {32, 14, 0, 2, 0xFF, 0xCA, 0xFE, 0}, 0);
    say(0x1CEBFF03, {2, 1, 2, 3, 4, 5, 6, 7}, 1);
    say(0x1CEBFF03, {1, 1, 2, 3, 4, 5, 6, 7}, 2);
    EXPECT_FALSE(transport.next(message)) << "the second came first";
    say(0x1CECFF03, {32, 14, 0, 3, 0xFF, 0xCA, 0xFE, 0}, 3);
    say(0x1CEBFF03, {1, 1, 2, 3, 4, 5, 6, 7}, 4);
    EXPECT_FALSE(transport.next(message)) << "14 bytes are not 3 packets";
    say(0x1CECFF03, {32, 14, 0, 2, 0xFF, 0xCA, 0xFE, 0}, 10);
    say(0x1CEBFF03, {1, 1, 2, 3, 4, 5, 6, 7}, 11);
    transport.run(800 * kMs, bus.end(0));
    say(0x1CEBFF03, {2, 1, 2, 3, 4, 5, 6, 7}, 801 * kMs);
    EXPECT_FALSE(transport.next(message)) << "too late";
    say(0x1CECFF03, {32, 14, 0, 2, 0xFF, 0xCA, 0xFE, 0}, 900 * kMs);
    say(0x1CEBFF03, {1, 1, 2, 3, 4, 5, 6, 7}, 901 * kMs);
    say(0x1CEBFF03, {1, 1, 2, 3, 4, 5, 6, 7}, 902 * kMs);
    say(0x1CEBFF03, {2, 8, 9, 10, 11, 12, 13, 14}, 903 * kMs);
    ASSERT_TRUE(transport.next(message)) << "a repeated packet does no harm";
    EXPECT_EQ(message.pgn, 0xFECAU);
    EXPECT_EQ(message.length, 14);
    EXPECT_EQ(message.data[13], 14);
}

}  // namespace
}  // namespace shiftrig::io::can
