"""The rig on a real vcan, watched and fed with can-utils and a J1939 socket of the kernel (scripts/vcan-kernel).

usage: vcan_rig_test.py SHIFTRIG SHIFTRIG_TCU SOURCE_FOLDER
"""
import cmath
import csv
import json
import math
import os
import signal
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import time
import unittest

RIG, TCU, SOURCE = sys.argv[1:4]
SHIFT = SOURCE + "/config/scenarios/plough_upshift.yaml"
SENSOR_LOSS = SOURCE + "/config/scenarios/speed_sensor_loss.yaml"
CYCLES = {  # [ms], spec of the messages
    "0CF00400": 20, "0CF00300": 50, "0CF00203": 10, "18F00503": 100, "0C010305": 50, "0C000003": 10, "18FEF100": 100,
    "18F0010B": 100, "18FEF880": 1000, "0CFE48F0": 100, "0CFE49F0": 100, "18FF1003": 10, "18FF1103": 10, "18FF1203": 10,
    "18FF2080": 10, "18FF2180": 10, "18FF2280": 10, "18FF3080": 10, "18FF3180": 10}
BY_HAND = "18FF1003#0000E02E00000760"  # clutch F2: 12 bar; the line of docs/can.md


def rig(*arguments):
    command = [RIG, "run", "--bus", "can:vcan0", "--controller", "none", "--priority", "0",
               "--catch-up", "1000000", "--json", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def result_of(process):
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    return json.loads(out.splitlines()[-1])


class Controller:
    def __init__(self, *arguments):
        self.arguments = arguments

    def __enter__(self):
        self.process = subprocess.Popen([TCU, "--bus", "can:vcan0", *self.arguments], stderr=subprocess.PIPE, text=True)
        self.process.stderr.readline()
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.communicate(timeout=20)


class Candump:
    """candump -L into a list of (time [s], identifier, data in hexadecimal digits)."""
    LAST = "1FFFFFFE"  # sent by ourselves at the end: what came before it has been written then

    def __enter__(self):
        self.file = tempfile.NamedTemporaryFile("w+", suffix=".log")
        self.process = subprocess.Popen(["candump", "-L", "-r", "8000000", "vcan0"], stdout=self.file)
        time.sleep(0.3)
        return self

    def __exit__(self, *_):
        subprocess.run(["cansend", "vcan0", self.LAST + "#"], check=True)
        for _ in range(600):
            if any(identifier == self.LAST for _, identifier, _ in self.frames()):
                break
            time.sleep(0.1)
        self.process.terminate()
        self.process.wait()

    def frames(self):
        with open(self.file.name) as file:
            for line in file:
                if not line.endswith("\n"):
                    return
                stamp, _, frame = line.split()[:3]
                identifier, data = frame.split("#", 1)
                yield float(stamp[1:-1]), identifier, data


def wait_for(identifier, condition=lambda data: True, patience=120):
    """Until a frame with this identifier, and data that fulfil the condition, is on the bus."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as watch:
        extended = int(identifier, 16) | socket.CAN_EFF_FLAG
        watch.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", extended, extended))
        watch.bind(("vcan0",))
        watch.settimeout(patience)
        while not condition(watch.recv(16)[8:]):
            pass


def typical_slope(times):
    """The median slope of time over number, between any two of the times [Theil, Sen]: one late in four does not move it."""
    points = list(enumerate(times))[::max(1, len(times) // 300)]
    return statistics.median((t2 - t1) / (n2 - n1) for i, (n1, t1) in enumerate(points) for n2, t2 in points[i + 1:])


def period_near(times, wanted):
    """The period, within 3 % of the one wanted, on whose grid the times stand best [Schuster's periodogram].

    Times left out do not move it, nor those that are late now and then.
    """
    def order(period):
        return abs(sum(cmath.exp(2j * math.pi * t / period) for t in times))
    return max((wanted * (1 + i / 5000) for i in range(-150, 151)), key=order)


def first_command(table):
    """When F3 was first commanded [s]."""
    with open(table) as file:
        return next(float(row["time_s"]) for row in csv.DictReader(file) if float(row["clutch.F3.pressure_command_pa"]) > 0)


def changes(result):
    """When the friction pairs changed their state: {(kind, device): time of the first}."""
    first = {}
    for event in result["events"]:
        if event.get("device") in ("F2", "F3") and event.get("kind") in ("engage", "lock", "break_away", "release"):
            first.setdefault((event["kind"], event["device"]), event["time_s"])
    return first


class VcanRig(unittest.TestCase):
    def test_candump_shows_every_message_at_its_cycle_time(self):
        # In lockstep the order on the bus tells simulated time, whatever the clock of this kernel does: feedback A ends
        # each 10 ms.
        with Candump() as dump, Controller("--lockstep"):
            result_of(rig("--scenario", SHIFT, "--pace", "lockstep"))
        now, times = 0, {}
        for _, identifier, _ in dump.frames():
            times.setdefault(identifier, []).append(now)
            now += 10 if identifier == "18FF2080" else 0
        self.assertEqual(now, 6000)
        self.assertEqual(sorted(set(CYCLES) - set(times)), [])
        for identifier, cycle in CYCLES.items():
            seen = times[identifier]
            self.assertGreaterEqual(len(seen), 6000 // cycle - 1, identifier)
            self.assertAlmostEqual((seen[-1] - seen[0]) / (len(seen) - 1), cycle, delta=0.02 * cycle, msg=identifier)

    def test_candump_shows_the_cycle_times_on_the_clock(self):
        # The rig in slow motion, the controller by its own clock: on one processor of user-mode Linux 1 kHz in real time
        # leaves too little to the others.
        slow = 4
        with Candump() as dump, Controller():
            result_of(rig("--scenario", SHIFT, "--duration", "4", "--factor", str(1 / slow)))
        times = {}
        for stamp, identifier, _ in dump.frames():
            times.setdefault(identifier, []).append(1000 * stamp)
        begin, end = times["18FF2080"][0], times["18FF2080"][-1]
        wrong = {}
        for identifier, cycle in CYCLES.items():
            if identifier == "18FF1003":
                continue  # follows feedback A, not the clock: see the test above
            seen = [t for t in times[identifier] if begin <= t <= end]
            if identifier.endswith("03"):  # the controller leaves out the cycles it sleeps through
                wanted, found = cycle, period_near(seen, cycle)
                self.assertGreater(len(seen), 0.6 * (end - begin) / cycle, identifier)  # every second one: half
            else:  # the rig makes up for them
                wanted, found = slow * cycle, typical_slope(seen)
            if abs(found - wanted) > 0.02 * wanted:
                wrong[identifier] = found
        self.assertEqual(wrong, {}, "cycle times [ms]")

    def test_a_lost_sensor_is_told_as_dm1_while_it_is_lost(self):
        with Candump() as dump, Controller("--lockstep"):
            result_of(rig("--scenario", SENSOR_LOSS, "--pace", "lockstep"))
        now, told = 0, []  # simulated time: feedback A ends each 10 ms
        for _, identifier, data in dump.frames():
            now += 10 if identifier == "18FF2080" else 0
            if identifier == "18FECA80":
                told.append((now, data))
        lost = [(at, data) for at, data in told if data != "00FF00000000FFFF"]
        self.assertEqual([data for _, data in lost], ["04FFBF000501FFFF"] * 4, told)  # amber, SPN 191, FMI 5, the first time
        self.assertEqual([at for at, _ in lost], [2000, 3000, 4000, 5000])
        self.assertEqual([at for at, _ in told if at > 5000], [6000, 7000, 8000, 9000])
        self.assertGreaterEqual(len([at for at, _ in told if at < 2000]), 2, "none, before")

    def test_the_kernel_puts_several_troubles_together_again(self):
        with open(SENSOR_LOSS) as file:
            scenario = file.read().replace("../tractor", SOURCE + "/config/tractor")
        two = scenario.replace("  - {at_s: 2.0,", "  - {at_s: 2.0, sensor.input.stuck: 1}\n  - {at_s: 2.0,")
        self.assertNotEqual(two, scenario)
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file, \
                socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, socket.CAN_J1939) as listener:
            file.write(two)
            file.flush()
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            listener.bind(("vcan0", socket.J1939_NO_NAME, 0xFECA, socket.J1939_NO_ADDR))
            listener.settimeout(60)
            with Controller("--lockstep"):
                process = rig("--scenario", file.name, "--duration", "4", "--pace", "lockstep")
                while True:
                    data, (_, _, pgn, source) = listener.recvfrom(300)
                    if pgn == 0xFECA and source == 0x80 and len(data) > 8:
                        break
                result_of(process)
        self.assertEqual(data.hex(), "04ff" "a1000201" "bf000501")  # SPN 161 FMI 2, SPN 191 FMI 5

    def test_a_command_made_by_hand_moves_the_clutch(self):
        with tempfile.NamedTemporaryFile("r", suffix=".csv") as table:
            process = rig(SOURCE + "/config/tractor.yaml", "--duration", "3", "--csv", table.name)
            wait_for("18FF2080")  # the rig has begun
            time.sleep(0.5)       # and nobody has commanded it for longer than the timeout
            subprocess.run(["cansend", "vcan0", BY_HAND], check=True)
            result = result_of(process)
            rows = list(csv.DictReader(table))
        heard = [i for i, row in enumerate(rows) if row["bus.ClutchCommandA.status"] == "1"]
        valid = [i for i, row in enumerate(rows) if i > 200 and row["bus.command_valid"] == "1"]
        pressures = [float(row["clutch.F2.pressure_pa"]) for row in rows]
        # Ticks, not seconds: the frame acts from a cycle and a half after it came, until its timeout of 100 ms.
        self.assertEqual((valid[0] - heard[0], valid[-1] - heard[0]), (15, 100))
        self.assertEqual(len(valid), 86)
        self.assertEqual(max(pressures[:heard[0]]), 0)
        self.assertGreater(max(pressures), 5e5, "the clutch is being filled")
        self.assertLess(pressures[-1], 0.1e5, "silence since then is the safe command")
        self.assertEqual(result["final"]["rig.safe_command"], 1)
        self.assertEqual(max(float(row["clutch.F1.pressure_pa"]) for row in rows), 0)

    def test_an_interface_that_goes_down_in_mid_shift_is_survived(self):
        # A slow shift, so that its middle is not missed; and a run that ends when everything has been seen.
        with open(SOURCE + "/config/calibration/tractor.yaml") as file:
            calibration = file.read()
        for was, now in (("torque_time_s: 0.08", "torque_time_s: 0.5"), ("inertia_time_s: 0.25", "inertia_time_s: 6"),
                         ("timeout_s: 1.2", "timeout_s: 9"), ("../can", SOURCE + "/config/can")):
            self.assertIn(was, calibration)
            calibration = calibration.replace(was, now)
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as slow:
            slow.write(calibration)
            slow.flush()
            with Controller("--calibration", slow.name):
                process = rig("--scenario", SHIFT, "--duration", "120")
                wait_for("0C010305", lambda data: data[2] == 125 + 3)     # the lever stands at 3 …
                wait_for("0CF00203", lambda data: data[0] >> 4 & 3 == 1)  # … and the controller says "shift in process"
                subprocess.run(["ip", "link", "set", "vcan0", "down"], check=True)
                time.sleep(1)
                subprocess.run(["ip", "link", "set", "vcan0", "up"], check=True)
                for _ in range(50):  # half a second of the rig's time in which both are heard again
                    wait_for("18FF2080")
                    wait_for("18FF1003")
                process.send_signal(signal.SIGINT)
                out, err = process.communicate(timeout=300)
        self.assertEqual(process.returncode, 0, err)
        result = json.loads(out.splitlines()[-1])
        happened = [(e["time_s"], e["kind"], e.get("device")) for e in result["events"]]
        # A controller that the kernel does not let run for 100 ms is silent, too: such pairs may come besides.
        silent = [t for t, kind, _ in happened if kind == "safe_command" and t > 2.1]
        self.assertTrue(silent, happened)
        self.assertFalse([t for t, kind, device in happened if (kind, device) == ("lock", "F3") and t < silent[0]], happened)
        self.assertTrue([t for t, kind, _ in happened if kind == "commands_return" and t > silent[0] + 0.5], happened)
        self.assertEqual(result["ticks"], round(1000 * result["sim_time_s"]))
        self.assertEqual(result["loop"]["skipped"], 0)
        self.assertIn("reconnects", err)
        self.assertIn("frames not sent", err)

    def test_a_j1939_socket_of_the_kernel_receives_etc1_and_eec1(self):
        with socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, socket.CAN_J1939) as listener:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            listener.bind(("vcan0", socket.J1939_NO_NAME, socket.J1939_NO_PGN, socket.J1939_NO_ADDR))
            listener.settimeout(20)
            with Controller():
                process = rig("--scenario", SHIFT, "--duration", "2")
                heard = {}
                while not {0xF002, 0xF004} <= set(heard):
                    data, (_, _, pgn, source) = listener.recvfrom(128)
                    heard[pgn] = (source, data)
                result_of(process)
        source, etc1 = heard[0xF002]
        self.assertEqual((source, len(etc1)), (3, 8))
        source, eec1 = heard[0xF004]
        self.assertEqual((source, len(eec1)), (0, 8))
        self.assertAlmostEqual((eec1[3] | eec1[4] << 8) * 0.125, 1801, delta=30)

    def test_canplayer_and_the_rigs_own_replay_give_the_same_shift(self):
        # The log is made in lockstep, its times are simulated ones. canplayer tells it in slow motion to a rig in slow
        # motion: what the kernel is late (a plain cangen of 10 ms is up to 30 ms late in user-mode Linux on a busy
        # machine) is then a fifth of that in the rig's time, and the bar of 20 ms is one.
        slow = 5
        with tempfile.TemporaryDirectory() as folder:
            whole, commands, stretched = (os.path.join(folder, name) for name in ("whole.log", "commands.log", "slow.log"))
            with Controller("--lockstep"):
                first = result_of(rig("--scenario", SHIFT, "--duration", "9", "--pace", "lockstep", "--can-log", whole))
            with open(whole) as log, open(commands, "w") as own, open(stretched, "w") as theirs:
                for line in log:
                    stamp, interface, frame = line.split()[:3]
                    if frame.split("#")[0] in CYCLES and frame.split("#")[0].endswith("03"):
                        own.write(line)
                        theirs.write("(%.6f) %s %s\n" % (slow * float(stamp[1:-1]), interface, frame))
            own = os.path.join(folder, "own.csv")
            ours = result_of(rig("--scenario", SHIFT, "--pace", "free", "--can-replay", commands, "--csv", own))
            # The player first: the rig begins in the two seconds of the log before the shift.
            player = subprocess.Popen(["canplayer", "-I", stretched])
            played = os.path.join(folder, "played.csv")
            theirs = result_of(rig("--scenario", SHIFT, "--duration", "4", "--factor", str(1 / slow), "--csv", played))
            player.terminate()
            player.wait()
            began = {name: first_command(name) for name in (own, played)}
        for name, result in (("first", first), ("own", ours), ("played", theirs)):
            self.assertEqual([(s["from"], s["to"], s["completed"]) for s in result["shifts"]], [("F2", "F3", True)], name)
        self.assertNotIn("safe_command", [event["kind"] for event in ours["events"] + theirs["events"]])
        # Two clocks that were started by hand have no common zero: times count from the first command to F3.
        theirs, ours = changes(theirs), changes(ours)
        self.assertEqual(sorted(theirs), sorted(ours))
        self.assertGreaterEqual(len(ours), 3)
        off = {change: (theirs[change] - began[played]) - (ours[change] - began[own]) for change in ours}
        print("canplayer against the rig's own replay [ms]:", {" ".join(c): round(1000 * d, 1) for c, d in off.items()}, file=sys.stderr)
        for change, difference in off.items():
            self.assertLess(abs(difference), 0.020, change)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[4:]])
