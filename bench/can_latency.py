#!/usr/bin/env python3
"""Latency from a command frame to the first speed frame that reflects it, beside a bare write and read on the same bus.

    bench/can_latency.py build/release/shiftrig socketcan vcan0
    bench/can_latency.py build/release/shiftrig udp_multicast 239.74.163.2

The machine is one mass that turns faster the moment a torque acts, the speed frame goes out every tick (1 ms): what is
left is the way through port, link, step, link and port, and the wait for the next tick (0 to 1 ms).
"""
import os
import struct
import subprocess
import sys
import tempfile
import time

import can

MODEL = """name: latency
masses:
  wheel: {inertia_kg_m2: 1}
  other: {inertia_kg_m2: 1}
sources:
  wheel: {mass: wheel, input: true}
input_mass: wheel
output_mass: wheel
can:
  dbc: latency.dbc
  bit_rate: 1000000
  rig_nodes: [Rig]
  messages:
    Torque: {signals: {Torque: source.wheel.torque}, when_lost: hold}
    Speed: {cycle_ms: 1, signals: {Speed: mass.wheel.speed}}
"""
DBC = """BU_: Rig Tester
BO_ 256 Torque: 4 Tester
 SG_ Torque : 0|32@1- (0.001,0) [0|0] "Nm" Rig
BO_ 257 Speed: 8 Rig
 SG_ Speed : 0|64@1- (0.000000001,0) [0|0] "rad/s" Tester
"""


def report(name, seconds):
    us = sorted(1e6 * s for s in seconds)
    pick = lambda share: us[min(int(share * len(us)), len(us) - 1)]
    print("%-52s p50 %7.0f  p90 %7.0f  p99 %7.0f  max %7.0f us" % (name, pick(0.5), pick(0.9), pick(0.99), us[-1]))


def torque(newton_metres):
    return can.Message(arbitration_id=0x100, is_extended_id=False, data=struct.pack("<i", 1000 * newton_metres))


def next_speed(bus):
    while True:
        message = bus.recv(5)
        if message is None:
            sys.exit("the rig fell silent")
        if message.arbitration_id == 0x101:
            return message.data


def main():
    rig, interface, channel = sys.argv[1:4]
    bus_name = "can:" + channel if interface == "socketcan" else "udpcan:%s:43113" % channel
    sender, receiver = (can.Bus(interface=interface, channel=channel) for _ in range(2))
    bare = []
    for _ in range(1000):
        start = time.perf_counter()
        sender.send(can.Message(arbitration_id=0x7F0, is_extended_id=False, data=bytes(8)))
        while receiver.recv(1).arbitration_id != 0x7F0:
            pass
        bare.append(time.perf_counter() - start)
        time.sleep(0.001)

    with tempfile.TemporaryDirectory() as folder:
        for name, text in (("latency.yaml", MODEL), ("latency.dbc", DBC)):
            with open(os.path.join(folder, name), "w") as file:
                file.write(text)
        process = subprocess.Popen([rig, "run", os.path.join(folder, "latency.yaml"), "--bus", bus_name, "--controller", "none"],
                                   stdout=subprocess.DEVNULL)
        latency, ticks = [], []
        for i in range(1000):
            time.sleep(0.003 + 0.001 * (i % 7) / 7)  # anywhere within the rig's tick
            before = next_speed(receiver)
            while receiver.recv(0) is not None:  # what is still in the queue
                pass
            # A torque of 1 Nm for a moment: the wheel stands still until it acts, and stands higher afterwards.
            start = time.perf_counter()
            sender.send(torque(1))
            frames = 1
            while next_speed(receiver) == before:
                frames += 1
            latency.append(time.perf_counter() - start)
            ticks.append(frames)
            sender.send(torque(0))
            time.sleep(0.01)  # until it acts no more
            while receiver.recv(0) is not None:
                pass
        process.terminate()
        process.wait()
    report("bare write and read", bare)
    report("command frame to the speed frame that reflects it", latency)
    few = [ticks.count(n) for n in (1, 2, 3)]
    print("ticks until it shows: 1 in %d, 2 in %d, 3 in %d, more in %d of %d" % (*few, len(ticks) - sum(few), len(ticks)))


if __name__ == "__main__":
    main()
