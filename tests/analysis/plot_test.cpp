#include "analysis/plot.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/analysis/synthetic_run.h"

namespace shiftrig::analysis {
namespace {

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t n = 0;
    for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
    return n;
}

Plot plot_of_the_upshift() {
    SyntheticRun synthetic = upshift();
    Change change;
    change.device = "B";
    change.event.kind = plant::EventKind::lock;
    change.event.time = 5.7;
    synthetic.run.changes = {change};
    change.event.time = 9;  // outside
    synthetic.run.changes.push_back(change);
    return plot_of_shift(synthetic.run, find_shifts(synthetic.run).at(0));
}

TEST(Plot, ShowsTheShiftFromBeforeItsCommandToAfterItsSettling) {
    const Plot plot = plot_of_the_upshift();
    EXPECT_EQ(plot.title, "A → B, power upshift, completed");
    EXPECT_NEAR(plot.from, 4.8, 1e-9);
    EXPECT_NEAR(plot.until, 6.876, 1e-3);
    EXPECT_NEAR(plot.shaded_from, 5.0, 1e-9);
    EXPECT_NEAR(plot.shaded_until, 5.676, 1e-3);
    std::set<std::string> panels, marks;
    for (const PlotPanel& panel : plot.panels) panels.insert(panel.title);
    for (const PlotMark& mark : plot.marks) marks.insert(mark.text);
    EXPECT_EQ(panels,
              (std::set<std::string>{"command", "speed", "clutch torque", "drive torque", "acceleration"}));
    EXPECT_EQ(marks, (std::set<std::string>{"asked for", "completed", "B locks"}));
}

TEST(Plot, SpeedOfTheInputMeetsTheOldGearBeforeAndTheNewOneAfter) {
    const Plot plot = plot_of_the_upshift();
    for (const PlotPanel& panel : plot.panels) {
        if (panel.title != "speed") continue;
        ASSERT_EQ(panel.lines.size(), 4u);  // engine as gearbox input, two gears, engine
        EXPECT_NEAR(panel.lines[0].value[4900], panel.lines[1].value[4900], 1e-9);
        EXPECT_NEAR(panel.lines[0].value[6800], panel.lines[2].value[6800], 1e-9);
        EXPECT_NEAR(panel.lines[0].value[4900], 120 * 30 / 3.14159265358979, 1e-6);  // rpm
        return;
    }
    FAIL() << "no panel of speeds";
}

TEST(Plot, SvgHasALinePerSignalAndEscapesNames) {
    Plot plot = plot_of_the_upshift();
    plot.title = "<A & \"B\">";
    std::size_t lines = 0;
    for (const PlotPanel& panel : plot.panels) lines += panel.lines.size();
    const std::string svg = to_svg(plot);
    EXPECT_EQ(count(svg, "<path fill=\"none\""), lines);
    EXPECT_EQ(count(svg, "<text "), count(svg, "</text>"));
    EXPECT_NE(svg.find("&lt;A &amp; &quot;B&quot;>"), std::string::npos);
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(Plot, LongRunIsThinnedButKeepsItsExtremes) {
    SyntheticRun synthetic = driving_in_a(600);
    synthetic.set("body.vehicle.acceleration",
                  [](double t) { return std::abs(t - 300.001) < 1e-6 ? 9.0 : 0.0; });
    const std::string svg = to_svg(plot_of_stretch(synthetic.run, 0, 600));
    EXPECT_LT(svg.size(), 1'500'000u);
    EXPECT_NE(svg.find(">8<"), std::string::npos);  // the axis reaches the single peak
}

TEST(Plot, MissingSignalsMakeNoPanelAndNoCrash) {
    SyntheticRun synthetic = upshift();
    const Shift shift = find_shifts(synthetic.run).at(0);
    synthetic.run.columns.clear();
    const std::string svg = to_svg(plot_of_shift(synthetic.run, shift));
    EXPECT_NE(svg.find("</svg>"), std::string::npos);
}

}  // namespace
}  // namespace shiftrig::analysis
