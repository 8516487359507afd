#include "rt/trace.h"

#include <gtest/gtest.h>

#include <sstream>

namespace shiftrig::rt {
namespace {

TEST(Trace, WritesSpansInMicrosecondsOfTheFirst) {
    Trace trace(8);
    const auto step = trace.name("step"), send = trace.name("send \"x\"", "bus");
    trace.span(step, 5'000'000, 5'001'234, 3);
    trace.span(send, 5'001'300, 5'001'300);
    std::ostringstream out;
    trace.write(out);
    EXPECT_EQ(out.str(), R"({"displayTimeUnit":"ns","otherData":{"overwritten":0},"traceEvents":[
{"ph":"M","name":"thread_name","pid":1,"tid":1,"args":{"name":"plant"}},
{"ph":"M","name":"thread_name","pid":1,"tid":2,"args":{"name":"bus"}},
{"ph":"X","name":"step","pid":1,"tid":1,"ts":0.000,"dur":1.234,"args":{"slot":3}},
{"ph":"X","name":"send \"x\"","pid":1,"tid":2,"ts":1.300,"dur":0.000}
]}
)");
}

TEST(Trace, KeepsTheLastSpansAndSaysHowManyItOverwrote) {
    Trace trace(4);
    const auto step = trace.name("step");
    for (int i = 0; i < 10; ++i) trace.span(step, i * 1000, i * 1000 + 10, i);
    EXPECT_EQ(trace.overwritten(), 6);
    std::ostringstream out;
    trace.write(out);
    EXPECT_NE(out.str().find("\"overwritten\":6"), std::string::npos);
    EXPECT_EQ(out.str().find("\"slot\":5"), std::string::npos);
    for (int i = 6; i < 10; ++i)
        EXPECT_NE(out.str().find("\"slot\":" + std::to_string(i)), std::string::npos);
}

TEST(Trace, WithoutCapacityItRecordsNothing) {
    Trace trace(0);
    trace.span(trace.name("step"), 0, 1);
    EXPECT_EQ(trace.count(), 0);
}

}  // namespace
}  // namespace shiftrig::rt
