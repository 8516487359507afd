#!/usr/bin/env python3
"""A shift controller in a few lines of python-can: follows the lever, one clutch handing over to the next.

    python_controller.py socketcan vcan0
    python_controller.py udp_multicast 239.74.163.2

It knows frames only (config/can/shiftrig.dbc): TC1 tells the wanted gear; each clutch feedback frame A, every
10 ms, is answered by the command frames C, B, A, the last with the counter of the question.
"""
import struct
import sys

import can

TC1, FEEDBACK_A = 0x0100, 0xFF20  # parameter groups that are listened to
COMMAND = {"A": 0x18FF1003, "B": 0x18FF1103, "C": 0x18FF1203}
FULL, FILL, KISS, HANDOVER, SYNC = 18.0, 4.0, 1.2, 9.0, 11.0  # [bar]
CLUTCH = {1: 0, 2: 1, 3: 2, 4: 3, -1: 4}  # gear -> F1, F2, F3, F4, FR

def command(identifier, slots, counter):
    """Three slots [bar] in 0.1 kPa (None: not enabled), counter, TSC1 checksum (SAE J1939-71)."""
    enabled = sum(1 << i for i, slot in enumerate(slots) if slot is not None)
    data = struct.pack("<3HB", *(0xFFFF if slot is None else round(1000 * slot) for slot in slots), enabled)
    total = sum(data) + counter + sum(identifier.to_bytes(4, "little"))
    checksum = ((total >> 6 & 3) + (total >> 3) + total) & 7
    return can.Message(arbitration_id=identifier, data=data + bytes([checksum << 4 | counter]))

def pressures(gear, target, t):
    """[bar] of F1, F2, F3, F4, FR, t seconds after the change from `gear` to `target` was wanted."""
    bars = [0.0] * 5
    if gear in CLUTCH and (t < 0.12 or gear == target):
        bars[CLUTCH[gear]] = FULL
    if gear != target and target in CLUTCH:
        share = min(max((t - 0.12) / 0.08, 0), 1)  # of the torque that has been handed over
        bars[CLUTCH[target]] = FILL if t < 0.1 else KISS + share * (HANDOVER - KISS) if share < 1 else SYNC
        if gear in CLUTCH and t >= 0.12:
            bars[CLUTCH[gear]] = (1 - share) * HANDOVER
    return bars

bus = can.Bus(interface=sys.argv[1], channel=sys.argv[2])
gear = target = None  # of the powershift group, and where it is going
began = cycle = lever = 0
print("listening", flush=True)
for message in bus:
    group = message.arbitration_id >> 8 & 0x3FFFF if message.is_extended_id else 0
    if group & 0x3FF00 == TC1 and message.data[2] <= 250:
        lever = message.data[2] - 125
        gear, target = (lever, lever) if gear is None else (gear, target)  # first: stay in the gear asked for
    elif group == FEEDBACK_A and gear is not None:
        cycle += 1
        if gear == target != lever:
            target, began = lever, cycle
        if gear != target and cycle - began > 60:
            gear = target
            print("in gear", gear, flush=True)
        bars = pressures(gear, target, 0.01 * (cycle - began))
        bus.send(command(COMMAND["C"], [0, None, None], cycle % 16))  # main clutch closed
        bus.send(command(COMMAND["B"], [*bars[3:], None], cycle % 16))
        bus.send(command(COMMAND["A"], bars[:3], message.data[7] & 0x0F))
