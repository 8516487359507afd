#!/usr/bin/python3
"""Draws a figure of docs/validation.md from the CSV that shiftrig_figure_data wrote: plot.py NAME CSV SVG."""
import csv
import sys

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

BLUE, ORANGE, GREEN, RED, GREY = "#1f5fa8", "#d9820f", "#2a8a4a", "#b8322a", "#8a8f98"
plt.rcParams.update({
    "font.family": "sans-serif", "font.size": 9, "axes.spines.top": False, "axes.spines.right": False,
    "axes.grid": True, "grid.color": "#e4e6ea", "grid.linewidth": 0.7, "axes.axisbelow": True,
    "lines.linewidth": 1.4, "legend.frameon": False, "axes.titlesize": 9.5, "axes.titleweight": "bold",
    "axes.titlelocation": "left", "svg.hashsalt": "shiftrig", "svg.fonttype": "none", "figure.constrained_layout.use": True,
    "path.simplify_threshold": 0.6})


def read(path):
    """Tables separated by an empty line, each a list of dicts with numbers where they are numbers."""
    tables = []
    with open(path, newline="") as file:
        for block in file.read().strip().split("\n\n"):
            rows = []
            for row in csv.DictReader(block.splitlines()):
                rows.append({k: number(v) for k, v in row.items()})
            tables.append(rows)
    return tables


def number(text):
    try:
        return float(text)
    except ValueError:
        return text


def column(rows, name):
    return [row[name] for row in rows]


def thin(rows, limit=600):
    """Every n-th row: files stay small, lines stay lines."""
    return rows[::max(1, len(rows) // limit)]


def against_curves(rows, signals, unit):
    """Published curve and plant above, their difference below."""
    figure, axes = plt.subplots(2, 1, figsize=(7, 4.6), sharex=True, height_ratios=(3, 2))
    colours = (BLUE, ORANGE, GREEN, RED)
    shown = thin(rows)
    for (name, label), colour in zip(signals, colours):
        axes[0].plot(column(shown, "time"), column(shown, name), color=colour, label=label)
        axes[0].plot(column(shown, "time"), column(shown, name + " plant"), "k:", linewidth=1)
        for kind, style in ((" plant", "-"), (" next step", ":")):
            axes[1].semilogy(column(shown, "time"), [max(abs(r[name] - r[name + kind]), 1e-9) for r in shown], style, color=colour)
    axes[0].plot([], [], "k:", label="plant, 1 ms")
    axes[0].set_ylabel(unit)
    axes[0].legend(ncols=3)
    axes[1].plot([], [], "-", color=GREY, label="localised")
    axes[1].plot([], [], ":", color=GREY, label="next step")
    axes[1].legend(ncols=2)
    axes[1].set(ylabel="difference", xlabel="time [s]")
    return figure


def coupled_clutches(tables):
    return against_curves(tables[0], (("J1.w", "J1"), ("clutch1.w_rel", "clutch 1, slip"), ("clutch2.w_rel", "clutch 2, slip"),
                                      ("clutch3.w_rel", "clutch 3, slip")), "speed [rad/s]")


def lossy_gear(tables):
    return against_curves(tables[0], (("Inertia2.w", "speed of J2 [rad/s]"),), "speed [rad/s]")


def friction(tables):
    return against_curves(tables[0], (("inertia3.w", "J3"), ("clutch.w_rel", "clutch, slip"), ("spring.w_rel", "spring, twist rate")),
                          "speed [rad/s]")


def stick_slip(tables):
    errors, trace = tables
    figure, (left, right) = plt.subplots(1, 2, figsize=(7, 2.9), width_ratios=(3, 2))
    left.plot(column(trace, "time"), column(trace, "position"), color=BLUE, label="localised, 1 ms")
    left.plot(column(trace, "time"), column(trace, "next_step_20ms"), ":", color=RED, label="next step, 20 ms")
    left.set(xlabel="time [s]", ylabel="position [m]", title="load on a belt")
    left.legend(loc="lower right")
    steps = [1e3 * s for s in column(errors, "step")]
    right.loglog(steps, column(errors, "localised"), "o-", color=BLUE)
    right.loglog(steps, column(errors, "next_step"), "s:", color=RED)
    right.set(xlabel="step [ms]", ylabel="error [s]", title="second break-away", ylim=(1e-11, 1))
    return figure


def light_body(tables):
    rows = [r for r in tables[0] if 1.95 <= r["time"] <= 2.25]
    figure, (top, middle) = plt.subplots(2, 1, figsize=(7, 4.2), sharex=True)
    for name, colour in (("engine", BLUE), ("ring", ORANGE), ("load", GREEN)):
        top.plot(column(rows, "time"), column(rows, name), color=colour, label=name)
        top.plot(column(rows, "time"), column(rows, name + " reference"), "k:", linewidth=1)
    top.plot([], [], "k:", label="reference")
    top.set(ylabel="speed [rad/s]", title="a ring of 0.0001 kg m² between a fading brake and a closing clutch")
    top.legend(ncols=4)
    for name, colour in (("brake torque", RED), ("clutch torque", BLUE)):
        middle.plot(column(rows, "time"), column(rows, name), color=colour, label=name)
    middle.set(xlabel="time [s]", ylabel="torque [Nm]")
    middle.legend()
    return figure


def wrong_models(tables):
    held, closing = tables
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.5, 2.9))
    left.plot(column(held, "time"), column(held, "first"), color=BLUE, label="J1, plant")
    left.plot(column(held, "time"), column(held, "second"), color=ORANGE, label="J2, plant")
    left.plot(column(held, "time"), column(held, "eq. (2)"), "--", color=RED, label="both, eq. (2)")
    left.set(xlabel="time [s]", ylabel="speed [rad/s]", title="capacity 3 Nm, internal torque 9.1 Nm")
    left.legend(fontsize=8)
    right.plot(column(closing, "time"), column(closing, "slip"), color=BLUE, label="plant")
    right.plot(column(closing, "time"), column(closing, "eq. (1)"), "--", color=RED, label="eq. (1), |Δω| < 0.3 rad/s")
    right.set(xlabel="time [s]", ylabel="slip [rad/s]", title="closing at 0.0908 s", ylim=(-3, 12))
    right.legend(fontsize=8)
    return figure


def table_2(tables):
    rows = tables[0]
    figure, axis = plt.subplots(figsize=(7, 2.9))
    labels = 0
    for i, (gear, losses, title) in enumerate((("III", 0, "III, ideal"), ("III", 1, "III, losses"), ("V", 0, "V, ideal"), ("V", 1, "V, losses"))):
        chosen = [r for r in rows if r["gear"] == gear and r["losses"] == losses]
        for j, r in enumerate(chosen):
            difference = abs(r["printed"] - r["solved"])
            wrong = difference > 0.002
            axis.semilogy(i + (j - 4) * 0.08, max(difference, 2e-5), "o", color=RED if wrong else BLUE, markersize=4)
            if wrong:
                axis.annotate(f"row {r['row']:.0f} {r['link']}: printed {r['printed']:.3f}, solved {r['solved']:.4f}",
                              (i + (j - 4) * 0.08, difference), xytext=(2.3, 0.16 / 1.9 ** labels), ha="right", va="center",
                              fontsize=7.5, arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.6})
                labels += 1
    axis.axhline(0.002, color=GREY, linewidth=0.8)
    axis.text(-0.4, 0.0022, "rounding of the printed ratios", fontsize=7.5, color=GREY)
    axis.set_xticks(range(4), ["III, ideal", "III, losses", "V, ideal", "V, losses"])
    axis.set(ylabel="|printed − solved|", ylim=(1e-5, 0.3), xlim=(-0.5, 3.5))
    return figure


def shift(tables):
    rows = tables[0]
    figure, axes = plt.subplots(3, 3, figsize=(9, 6), sharex=True, sharey="row")
    for i, (case, title) in enumerate((("good", "good timing"), ("bad", "bad timing"), ("bad coulomb", "bad timing, Coulomb wheel contact"))):
        chosen = thin([r for r in rows if r["case"] == case], 375)
        t = column(chosen, "time")
        for name, colour in (("F2", BLUE), ("F3", ORANGE), ("Fc", GREEN)):
            axes[0][i].plot(t, column(chosen, name), color=colour, label=name)
        for name, colour in (("engine", BLUE), ("input", ORANGE), ("output", GREEN)):
            axes[1][i].plot(t, column(chosen, name), color=colour, label=name)
        axes[2][i].plot(t, column(chosen, "damper"), color=BLUE, label="damper")
        axes[2][i].plot(t, [v / 79.32 for v in column(chosen, "axle")], color=RED, label="axle ÷ 79.3")
        axes[0][i].set_title(title)
        axes[2][i].set_xlabel("time [s]")
    for axis, label in zip(axes[:, 0], ("clutch torque [Nm]", "speed [rad/s]", "shaft torque [Nm]")):
        axis.set_ylabel(label)
    for axis in axes[:, 2]:
        axis.legend(loc="upper right")
    return figure


def order(tables):
    rows = tables[0]
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.5, 3.4))
    cases = (("good", BLUE, "good timing"), ("bad", ORANGE, "bad timing"), ("bad coulomb", GREEN, "bad, Fw slips"))
    for case, colour, label in cases:
        for transition, style in (("localised", "o-"), ("next step", "s:")):
            chosen = [r for r in rows if r["case"] == case and r["transition"] == transition]
            steps = [1e3 * s for s in column(chosen, "step")]
            left.loglog(steps, column(chosen, "error"), style, color=colour, markersize=3.5, label=label if style == "o-" else None)
            right.loglog(steps, [max(r["energy defect"], 1e-12) / r["dissipated"] for r in chosen], style, color=colour, markersize=3.5)
    left.loglog([0.1, 1], [2e-5 * 0.1 ** 3, 2e-5], "--", color=GREY, linewidth=0.9)
    left.text(0.42, 6e-7, "order 3", color=GREY, fontsize=8)
    left.loglog([0.05, 0.7], [5e-2 * 0.05, 5e-2 * 0.7], "--", color=GREY, linewidth=0.9)
    left.text(0.06, 6e-3, "order 1", color=GREY, fontsize=8)
    left.set(xlabel="step [ms]", ylabel="RMS error ÷ RMS of the signal", title="worst of eight continuous signals")
    right.set(xlabel="step [ms]", ylabel="defect ÷ energy dissipated", title="energy ledger")
    left.plot([], [], "s:", color=GREY, markersize=3.5, label="next-step rule")
    left.legend(fontsize=8)
    return figure


def work_precision(tables):
    rows = tables[0]
    figure, axes = plt.subplots(1, 2, figsize=(8.5, 3.8), sharey=True)
    styles = {"plant": ("o-", BLUE), "RK4": ("^--", GREEN), "CVODE BDF": ("D--", ORANGE),
              "implicit Euler": ("v--", RED)}
    for axis, case, title in zip(axes, ("good", "bad coulomb"), ("good timing", "bad timing, wheel contact slips")):
        for method, (style, colour) in styles.items():
            chosen = [r for r in rows if r["case"] == case and r["method"] == method]
            if chosen:
                axis.loglog(column(chosen, "ns per ms"), column(chosen, "error"), style, color=colour, markersize=4, label=method)
        axis.set(xlabel="ns per simulated ms", title=title)
    axes[0].set_ylabel("worst RMS error ÷ RMS of the signal")
    axes[1].legend(fontsize=8)
    return figure


def sensitivity(tables):
    rows = tables[0]
    metrics = (("peak damper torque", "peak damper torque"), ("clutch heat", "clutch heat"), ("locked at", "F3 locks after"), ("peak acceleration", "peak acceleration"))
    names = []
    for r in rows:
        if r["estimate"] != "none" and r["estimate"] not in names:
            names.append(r["estimate"])
    figure, axes = plt.subplots(1, 4, figsize=(9, 6.2), sharey=True)
    for axis, (metric, title) in zip(axes, metrics):
        changes = {}
        for case, colour, offset in (("good", BLUE, 0.15), ("bad", ORANGE, -0.15)):
            base = next(r[metric] for r in rows if r["case"] == case and r["estimate"] == "none")
            for i, name in enumerate(reversed(names)):
                low, high = (next(r[metric] for r in rows if r["case"] == case and r["estimate"] == name and r["factor"] == f) for f in (0.7, 1.3))
                changes[i + offset] = [100 * (value / base - 1) for value in (low, high)], colour
        # What leaves the frame is named at its edge: one estimate must not flatten all others.
        edge = 25
        for y, ((low, high), colour) in changes.items():
            axis.plot([max(-edge, min(edge, low)), max(-edge, min(edge, high))], [y, y], "-", color=colour, linewidth=3)
            if abs(low) > edge:
                axis.text(edge, y, f"−30 %: {low:+.0f} % ", ha="right", va="bottom", fontsize=7)
            else:
                axis.plot(low, y, "|", color="black", markersize=6)
        axis.axvline(0, color=GREY, linewidth=0.8)
        axis.set(title=title, xlabel="change [%]", xlim=(-edge, edge))
    axes[0].set_yticks(range(len(names)), list(reversed(names)))
    axes[3].plot([], [], color=BLUE, linewidth=3, label="good")
    axes[3].plot([], [], color=ORANGE, linewidth=3, label="bad")
    axes[3].plot([], [], "|", color="black", label="−30 %")
    axes[3].legend(fontsize=8, loc=(0.55, 0.3))
    return figure


def random_systems(tables):
    rows = [r for r in tables[0] if r["outcome"] in ("agrees", "disagrees", "broken")]
    figure, axis = plt.subplots(figsize=(7, 3))
    worst = sorted(max(r["worst speed"], 1e-7) * 1e-4 for r in rows)
    axis.semilogx(worst, [100 * (i + 1) / len(worst) for i in range(len(worst))], color=BLUE)
    axis.axvline(1e-4, color=RED, linewidth=0.9)
    axis.set(xlabel="largest difference of a speed or twist ÷ its range", ylabel="share of machines below [%]",
             title=f"{len(worst)} random machines at 1 ms against the reference solver", ylim=(0, 100))
    return figure


if __name__ == "__main__":
    name, source, target = sys.argv[1:4]
    globals()[name](read(source)).savefig(target, metadata={"Date": None})
