#!/usr/bin/env python3
"""A shift controller in plain Python on LCM: follows the lever, one clutch handing over to the next.

    lcm_controller.py [GROUP [PORT]]        shiftrig run … --bus lcm:udpm://GROUP:PORT?ttl=0 --controller none

Every SHIFTRIG_SPEEDS is answered by a SHIFTRIG_CLUTCH_COMMAND that names its seq, so the same program works at
wall pace and in lockstep, where the rig waits for that answer.
"""
import os
import sys

from lcm_udpm import Types, Udpm

FULL, FILL, KISS, HANDOVER, SYNC = 18e5, 4e5, 1.2e5, 9e5, 11e5  # [Pa]
CLUTCH = {1: "F1", 2: "F2", 3: "F3", 4: "F4", -1: "FR"}


def pressures(gear, target, t):
    """[Pa] by clutch, t seconds after the change from `gear` to `target` was wanted."""
    wanted = {}
    share = min(max((t - 0.12) / 0.08, 0), 1)  # of the torque that has been handed over
    if gear in CLUTCH:
        wanted[CLUTCH[gear]] = FULL if t < 0.12 or gear == target else (1 - share) * HANDOVER
    if gear != target and target in CLUTCH:
        wanted[CLUTCH[target]] = FILL if t < 0.1 else KISS + share * (HANDOVER - KISS) if share < 1 else SYNC
    return wanted


def main():
    types = Types(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../lcmtypes"))
    lcm = Udpm(*(sys.argv[1:2] or ["239.255.76.67"]), *map(int, sys.argv[2:3]))
    clutches = gear = target = lever = answer = None
    asked, began, seq = -1, 0.0, 0
    print("listening", flush=True)
    while True:
        channel, data = lcm.receive()
        if channel == "SHIFTRIG_PLANT_INFO" and clutches is None:
            info = types["plant_info_t"].decode(data)
            if info:
                names = [bytes(name).split(b"\0")[0].decode() for name in info["clutch_name"]]
                clutches = names[:info["clutch_count"]]
        elif channel == "SHIFTRIG_DRIVER_INPUT":
            driver = types["driver_input_t"].decode(data)
            lever = driver["lever"] if driver else lever
        elif channel == "SHIFTRIG_SPEEDS" and clutches and lever is not None:
            speeds = types["speeds_t"].decode(data)
            if not speeds:
                continue
            now = 1e-9 * speeds["sim_time_ns"]
            if speeds["seq"] != asked:  # else the rig asks again: our answer was lost, it gets the same one
                asked = speeds["seq"]
                gear, target = (lever, lever) if gear is None else (gear, target)
                if gear == target != lever:
                    target, began = lever, now
                if gear != target and now - began > 0.6:
                    gear = target
                    print("in gear", gear, flush=True)
                wanted = pressures(gear, target, now - began)
                answer = {"sim_time_ns": speeds["sim_time_ns"], "answers_seq": asked, "clutch_count": len(clutches),
                          "enable": [name in CLUTCH.values() for name in clutches],
                          "pressure_pa": [wanted.get(name, 0.0) for name in clutches]}
            lcm.send("SHIFTRIG_CLUTCH_COMMAND", types["clutch_command_t"].encode({**answer, "seq": seq}))
            seq += 1


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
