// The rig as a citizen of a J1939 network: addresses, requests, faults, long messages.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
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

TEST_F(SettledNetwork, OneFaultIsADm1FrameEachSecondUntilItIsGoneAndThenOnceNone) {
    run(10);
    EXPECT_TRUE(of(0x18FECA80).empty());
    link.set_fault(0x7F123, 4, true);
    run(2000);
    const auto told = of(0x18FECA80);
    ASSERT_EQ(told.size(), 2U);
    // amber lamp; SPN 0x7F123: low byte 23, then F1, then the top three bits with FMI 4; first occurrence
    EXPECT_EQ(bytes(told[0]), "04FF23F1E401FFFF");
    link.set_fault(0x7F123, 4, false);
    run(3000);
    ASSERT_EQ(of(0x18FECA80).size(), 3U);
    EXPECT_EQ(bytes(of(0x18FECA80)[2]), "00FF00000000FFFF");
}

TEST_F(SettledNetwork, SeveralFaultsTravelAsAnAnnouncedMessage) {
    link.set_fault(100, 1, true);
    link.set_fault(200, 2, true);
    run(300);
    const auto announced = of(0x1CECFF80), packets = of(0x1CEBFF80);
    ASSERT_EQ(announced.size(), 1U);
    EXPECT_EQ(bytes(announced[0]), "200A0002FFCAFE00");
    ASSERT_EQ(packets.size(), 2U);
    EXPECT_EQ(bytes(packets[0]),
              "0104FF640001"
              "01C8");
    EXPECT_EQ(bytes(packets[1]),
              "02000201"
              "FFFFFFFF");
    EXPECT_GE(packets[1].timestamp_ns - packets[0].timestamp_ns, 50 * kMs);
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
