"""The example controllers shift the tractor over python-can's udp_multicast, and python-can reads on the bus what the
rig put on it.

usage: examples_test.py SHIFTRIG CPP_CONTROLLER SOURCE_FOLDER       (in a network that carries the group)
"""
import csv
import json
import math
import os
import socket
import subprocess
import sys
import tempfile
import threading
import unittest

import can

RIG, CPP, SOURCE = sys.argv[1:4]
SO_RCVBUFFORCE = 33  # of Linux; Python has no name for it
GROUP, PORT = "239.74.163.2", 43113
BUS = "udpcan:%s:%d" % (GROUP, PORT)
PYTHON_CONTROLLER = [sys.executable, SOURCE + "/apps/examples/python_controller.py", "udp_multicast", GROUP]
CPP_CONTROLLER = [CPP, BUS, SOURCE + "/config/can/tractor.yaml"]


def shift_with(controller, *arguments):
    """Runs plough_upshift in lockstep with a controller of its own process; returns the rig's result."""
    process = subprocess.Popen(controller, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "listening\n"
        done = subprocess.run(
            [RIG, "run", "--scenario", SOURCE + "/config/scenarios/plough_upshift.yaml", "--pace", "lockstep",
             "--controller", "none", "--bus", BUS, "--json", *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=300)
    finally:
        process.kill()
        process.communicate()
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


class Listener(threading.Thread):
    """Keeps every frame of the bus, in order."""

    def __init__(self):
        super().__init__(daemon=True)
        self.frames, self.ended = {}, False
        self.bus = can.Bus(interface="udp_multicast", channel=GROUP, port=PORT)
        # In lockstep six seconds pass in one: on a busy machine Python falls behind, and what waits must have room.
        with socket.socket(fileno=os.dup(self.bus.fileno())) as same:
            try:
                same.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, 8 << 20)
            except PermissionError:
                same.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
        self.start()

    def run(self):
        while True:  # until nothing more comes: the last frames may still wait in the socket
            message = self.bus.recv(0.2)
            if message is not None:
                self.frames.setdefault(message.arbitration_id, []).append(bytes(message.data))
            elif self.ended:
                return

    def stop(self):
        self.ended = True
        self.join()
        self.bus.shutdown()


def u16(data, at):
    return data[at] | data[at + 1] << 8


class Examples(unittest.TestCase):
    def assert_the_shift(self, result):
        shifts = result["shifts"]
        self.assertEqual([(s["from"], s["to"], s["completed"]) for s in shifts], [("F2", "F3", True)])
        self.assertLess(shifts[0]["duration_s"], 0.6)
        for clutch in ("F2", "F3"):
            self.assertLess(shifts[0]["clutch_energy_j"][clutch], 5000)
        self.assertEqual(result["loop"]["unanswered"], 0)
        self.assertEqual(result["final"]["bus.ClutchCommandA.status"], 1)

    def test_cpp_controller_completes_the_shift(self):
        result = shift_with(CPP_CONTROLLER)
        self.assert_the_shift(result)
        self.assertEqual(result["final"]["controller.current_gear"], 3)

    def test_python_controller_is_short(self):
        with open(PYTHON_CONTROLLER[1]) as file:
            self.assertLess(len(file.readlines()), 60)

    def test_python_controller_completes_the_shift_and_python_reads_what_the_rig_encoded(self):
        listener = Listener()
        with tempfile.TemporaryDirectory() as folder:
            table = os.path.join(folder, "run.csv")
            result = shift_with(PYTHON_CONTROLLER, "--csv", table)
            listener.stop()
            with open(table) as file:
                rows = list(csv.DictReader(file))
        self.assert_the_shift(result)

        rpm = math.pi / 30
        checks = [  # identifier, cycle [ms], decoder (in SI), column, half a bit
            (0x0CF00400, 20, lambda d: u16(d, 3) * 0.125 * rpm, "sensor.engine.speed_rad_s", 0.0625 * rpm),
            (0x18FF3080, 10, lambda d: (u16(d, 4) * 0.25 - 8000) * rpm, "sensor.input.speed_rad_s", 0.125 * rpm),
            (0x18FF3180, 10, lambda d: (u16(d, 2) * 0.25 - 8000) * rpm, "sensor.wheels.speed_rad_s", 0.125 * rpm),
            (0x18FF2080, 10, lambda d: u16(d, 4) * 100, "clutch.F3.pressure_pa", 50),
            (0x0CFE49F0, 100, lambda d: u16(d, 0) * 0.001, "mass.vehicle.speed_m_s", 0.0005),
            (0x18FEF880, 1000, lambda d: u16(d, 4) * 0.03125 - 273, "oil.temperature_degc", 0.015625),
        ]
        for identifier, cycle, decode, column, half_a_bit in checks:
            with self.subTest(column=column):
                seen = [decode(data) for data in listener.frames[identifier]]
                self.assertGreaterEqual(len(seen), 6000 // cycle - 1)
                self.assertLessEqual(len(seen), 6000 // cycle + 1)
                truth = [float(row[column]) for row in rows]
                # The frame's place within its cycle is the rig's business: one place must fit all frames.
                places = [place for place in range(cycle) if all(
                    abs(value - truth[min(place + cycle * k, len(truth) - 1)]) <= half_a_bit * 1.001
                    for k, value in enumerate(seen))]
                self.assertTrue(places, column)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[4:]])
