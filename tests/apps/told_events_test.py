"""What changed in a run, as `shiftrig run --json` and `shiftrig explain` tell it.

usage: told_events_test.py SHIFTRIG SHIFTRIG_TCU CONFIG
"""
import csv
import json
import sys
import unittest

from in_a_folder import Folder
from programs import CONFIG, command, free


class Told(Folder):
    def test_every_event_has_its_time_kind_device_and_words_whoever_tells_it(self):
        recording = self.path("shift.lcmlog")
        told = {"run": free("--record", recording, "--duration", "3")["events"],
                "explain": json.loads(command("explain", recording, "--json").stdout)}
        for who, events in told.items():
            for event in events:
                self.assertLessEqual({"time_s", "kind", "device", "text"}, event.keys(), (who, event))
            self.assertIn(("message_status", ""), {(e["kind"], e["device"]) for e in events}, who)
        of_machine = {who: [e for e in events if e["device"]] for who, events in told.items()}
        self.assertGreater(len(of_machine["run"]), 3)
        self.assertEqual(of_machine["run"], of_machine["explain"])

    def explained(self, model, duration, *options):
        with open(self.path("m.yaml"), "w") as file:
            json.dump(model, file)
        done = command("run", self.path("m.yaml"), "--pace", "free", "--controller", "none", "--duration", duration, "--record", self.path("m.lcmlog"))
        self.assertEqual(done.returncode, 0, done.stderr)
        return [json.loads(command("explain", self.path("m.lcmlog"), "--json", *more).stdout) for more in ((), *options)]

    def test_what_concerns_a_device_among_others_is_told_of_it(self):
        brake = {"a": "a", "b": "housing", "dry": {"sliding_capacity_nm": 50, "static_ratio": 1.3}, "direct": {"initial": 1}}
        model = {"name": "two brakes", "masses": {"a": {"inertia_kg_m2": 1, "initial_speed_rad_s": 20}},
                 "clutches": {"B1": brake, "B2": {**brake, "dry": {"sliding_capacity_nm": 30, "static_ratio": 1.1}}}}
        everything, first, second = self.explained(model, "0.4", ("--device", "B1"), ("--device", "B2"))
        loops = [e for e in everything if e["kind"] == "tie_up"]
        self.assertEqual([e["members"] for e in loops], [["B1", "B2"]])
        for device, told in (("B1", first), ("B2", second)):
            self.assertEqual(told, [e for e in everything if e["device"] == device or e in loops])
            self.assertGreater(len(told), 1)

    def test_what_a_step_could_not_tell_is_told_of_every_device(self):
        model = {"name": "many brakes", "masses": {}, "clutches": {}}
        for i in range(80):
            model["masses"][f"m{i}"] = {"inertia_kg_m2": 1, "initial_speed_rad_s": 20}
            model["clutches"][f"C{i}"] = {"a": f"m{i}", "b": "housing", "dry": {"sliding_capacity_nm": 50, "static_ratio": 1},
                                          "direct": {"initial": 1}}
        everything, = self.explained(model, "0.01")
        silent = sorted(model["clutches"].keys() - {e["device"] for e in everything})
        self.assertEqual(len(silent), 17)
        told = json.loads(command("explain", self.path("m.lcmlog"), "--json", "--device", silent[0]).stdout)
        self.assertEqual([(e["kind"], e["device"], e["count"]) for e in told], [("untold", "", 17)])

    def test_the_benchs_own_events_are_told_of_the_same_time_whoever_tells_them(self):
        recording, snapshot, table = self.path("run.lcmlog"), self.path("x.snap"), self.path("x.csv")
        own = lambda events: [e for e in events if e["kind"] in ("safe_command", "commands_return", "message_status")]
        found = set()
        for scenario in ("silent_controller", "corrupt_frames", "bus_load_full"):
            path = f"{CONFIG}/scenarios/{scenario}.yaml"
            told = own(free("--record", recording, "--csv", table, "--snapshot-at", "2.5", snapshot, scenario=path)["events"])
            self.assertEqual(own(json.loads(command("explain", recording, "--json").stdout)), told, scenario)
            found |= {(e["kind"], "bus fault" in e["text"]) for e in told}
            # The safe command is held over a whole tick: what acts from t on stands in the row of t + 1 ms.
            with open(table) as file:
                acts = {round(1000 * float(row["time_s"])) - 1: float(row["rig.safe_command"]) for row in csv.DictReader(file)}
            for event in told:
                if event["kind"] != "message_status":
                    began = round(1000 * event["time_s"])
                    self.assertEqual((acts[began], acts[began - 1]), (1, 0) if event["kind"] == "safe_command" else (0, 1), event)
            done = command("run", "--from", snapshot, "--pace", "free", "--json", "--record", recording)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(own(json.loads(command("explain", recording, "--json").stdout)),
                             own(json.loads(done.stdout)["events"]), scenario)
        self.assertEqual(found, {("safe_command", False), ("commands_return", False), ("message_status", False), ("message_status", True)})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
