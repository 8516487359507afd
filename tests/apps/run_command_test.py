"""`shiftrig run` and `shiftrig-tcu` as their user meets them: results, interruption, files left behind.

usage: run_command_test.py SHIFTRIG SHIFTRIG_TCU CONFIG
"""
import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import unittest

from programs import CONFIG, MULTICAST, SHIFT, SHIFTRIG, InAFolder, command, free, run


class Results(InAFolder):
    def test_final_object(self):
        result = free()
        self.assertEqual(result["ticks"], 6000)
        self.assertAlmostEqual(result["sim_time_s"], 6)
        self.assertGreater(result["real_time_factor"], 1)
        self.assertEqual(result["overruns"], 0)
        self.assertEqual([s["to"] for s in result["shifts"]], ["F3"])
        self.assertGreater(len(result["events"]), 3)
        self.assertAlmostEqual(result["final"]["mass.vehicle.speed_m_s"] * 3.6, 8.63, delta=0.26)

    def test_the_plants_certificate_of_the_whole_run(self):
        certificate = free()["certificate"]
        self.assertLess(abs(certificate["torque_residual"]), 1e-12)
        self.assertLess(certificate["constraint_violation_rad_s"], 1e-10)
        self.assertLess(abs(certificate["energy_defect_j"]), 1)
        self.assertEqual(certificate["fall_backs"], 0)
        self.assertGreaterEqual(certificate["changes_located"], 2)  # F3 locks, F2 breaks away
        self.assertGreater(certificate["modes_built"], 2)
        self.assertEqual(certificate["ticks"],
                         {"tie_up": 0, "direction_search_gave_up": 0, "not_finite": 0, "coarse": None, "instant_not_found": 0})  # steps are taken whole
        recording = self.path("shift.lcmlog")
        text = run("--scenario", SHIFT, "--pace", "free", "--record", recording).stdout
        told = [e for e in json.loads(command("explain", recording, "--json").stdout) if e["device"]]
        self.assertIn(f"plant     {len(told)} events told, " + "%(changes_located)d changes located inside steps, 0 fall-backs, %(mode_lookups)d mode look-ups, %(modes_built)d modes built; "
                      "torque residual " % certificate, text)
        self.assertNotIn("of 6000 ticks", text)

    def test_the_energy_of_the_certificate_is_that_of_this_run(self):
        snapshot = self.path("s.snap")
        free("--snapshot-at", "5", snapshot)
        pattern = r"energy defect \S+ J of (\S+) J lost"
        whole = float(re.search(pattern, run("--scenario", SHIFT, "--pace", "free").stdout)[1])
        rest = float(re.search(pattern, run("--from", snapshot, "--pace", "free").stdout)[1])
        self.assertGreater(rest, 0.1 * whole)  # a sixth of the time
        self.assertLess(rest, 0.25 * whole)

    def test_a_snapshot_goes_on_at_any_pace_and_its_can_log_is_the_end_of_the_whole_ones(self):
        snapshot, whole, rest = self.path("s.snap"), self.path("whole.log"), self.path("rest.log")
        final = free("--snapshot-at", "2.2", snapshot, "--can-log", whole)["final"]
        for pace in ("free", "lockstep"):
            done = run("--from", snapshot, "--pace", pace, "--json", "--can-log", rest)
            self.assertEqual(done.returncode, 0, done.stderr)
            again = json.loads(done.stdout.splitlines()[-1])["final"]
            self.assertEqual({k for k in final if final[k] != again[k] and not k.startswith("certificate.mode_")}, set())
            with open(whole) as file:  # what was said at the end of the tick before is not said again
                expected = [line for line in file if float(line[1:18]) > 2.2]
            with open(rest) as file:
                found = [line for line in file if float(line[1:18]) > 2.2]
            self.assertEqual(found, expected)

    def test_ticks_whose_parts_stay_coarse_are_told(self):
        # A shaft that swings 16 rad a millisecond, in parts of 8.
        def machine_with(method):
            machine = self.path(method + ".yaml")
            with open(machine, "w") as file:
                file.write("name: swing\nmethod: " + method + "\nmaximum_parts: 2\nmasses:\n"
                           "  a: {inertia_kg_m2: 1, initial_speed_rad_s: 1}\n"
                           "  b: {inertia_kg_m2: 1, initial_speed_rad_s: -1}\n"
                           "shafts:\n  s: {a: a, b: b, stiffness_nm_per_rad: 1.28e8, damping_nm_s_per_rad: 0}\n")
            return machine
        for method in ("etd3", "ark3"):
            text = run(machine_with(method), "--pace", "free", "--controller", "none", "--duration", "0.1").stdout
            self.assertRegex(text, r"in \d+ of 100 ticks even the shortest parts of a step are coarse", method)

    def test_initial_speeds_that_contradict_a_gear_are_told(self):
        machine = self.path("geared.yaml")
        with open(machine, "w") as file:
            file.write("name: geared\nmasses: {a: {inertia_kg_m2: 1, initial_speed_rad_s: 10}, b: {inertia_kg_m2: 1}}\n"
                       "gears: {g: {a: a, b: b, ratio: 2, efficiency: 1}}\n")
        done = run(machine, "--pace", "free", "--controller", "none", "--duration", "0.01", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, 'initial speeds contradict gear "g": the run begins with "a" at 8 rad/s instead of 10, '
                                      '"b" at 4 rad/s instead of 0\n')
        self.assertAlmostEqual(json.loads(done.stdout)["final"]["mass.a.speed_rad_s"], 8, 12)

    def test_ticks_that_the_disk_did_not_take_are_not_proven(self):
        """A minute at fifty times real time, into a pipe that nobody reads for a while."""
        pipe, recording = self.path("pipe"), self.path("shift.lcmlog")
        os.mkfifo(pipe)

        def read_late():
            with open(pipe, "rb") as source, open(recording, "wb") as file:
                file.write(source.read(1 << 20))
                time.sleep(3)
                shutil.copyfileobj(source, file)

        reader = threading.Thread(target=read_late)
        reader.start()
        done = run("--scenario", SHIFT, "--duration", "60", "--factor", "50", "--catch-up", "100000", "--record", pipe)
        reader.join()
        self.assertRegex(done.stderr, r"pipe: \d+ ticks were not kept: the disk did not keep up\n")
        self.assertEqual(done.returncode, 1)
        lost = int(re.search(r"pipe: (\d+) ticks", done.stderr).group(1))
        replayed = subprocess.run([SHIFTRIG, "replay", recording], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(replayed.returncode, 1, replayed.stderr + replayed.stdout)
        self.assertRegex(replayed.stdout, r"ticks agree bit for bit \(kernel \w+\)\n%d ticks are missing in the recording; " % lost)
        found = subprocess.run([SHIFTRIG, "replay", recording, "--json"], stdout=subprocess.PIPE, text=True)
        self.assertEqual((found.returncode, json.loads(found.stdout)["agrees"], json.loads(found.stdout)["lost"]), (1, False, lost))

    def test_csv_has_every_tick_and_names_with_units(self):
        path = self.path("shift.csv")
        result = free("--csv", path)
        with open(path) as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), result["ticks"])
        self.assertEqual(float(rows[-1]["mass.vehicle.speed_m_s"]), result["final"]["mass.vehicle.speed_m_s"])
        self.assertEqual(os.listdir(self.folder), ["shift.csv"])

    def test_csv_leaves_files_of_similar_names_alone(self):
        path, others = self.path("shift.csv"), ["shift.csv.lcmlog", "shift.lcmlog"]
        for name in others:
            with open(self.path(name), "w") as file:
                file.write("mine")
        free("--csv", path)
        for name in others:
            with open(self.path(name)) as file:
                self.assertEqual(file.read(), "mine")
        self.assertEqual(sorted(os.listdir(self.folder)), ["shift.csv", *others])

    def test_csv_that_cannot_be_written_leaves_nothing_behind(self):
        path = self.path("shift.csv")
        os.symlink("/dev/full", path)
        done = run("--scenario", SHIFT, "--pace", "free", "--csv", path, "--snapshot-at", "2", self.path("s.snap"))
        self.assertEqual(done.returncode, 1)
        self.assertIn(path + ": cannot be written: No space left on device\n", done.stderr)
        self.assertEqual(sorted(os.listdir(self.folder)), ["s.snap", "shift.csv"])
        done = run("--scenario", SHIFT, "--pace", "free", "--csv", "/nosuch/dir/shift.csv")
        self.assertEqual((done.returncode, done.stderr),
                         (2, "/nosuch/dir/shift.csv: cannot be written: No such file or directory\n"))

    def test_recording_replays_bit_for_bit_and_the_trace_is_json(self):
        recording, trace = self.path("shift.lcmlog"), self.path("trace.json")
        free("--record", recording, "--trace", trace)
        replayed = subprocess.run([SHIFTRIG, "replay", recording], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(replayed.returncode, 0, replayed.stderr + replayed.stdout)
        with open(trace) as file:
            self.assert_chrome_trace(json.load(file), ticks=6000)

    def noisy(self, seed):
        """A scenario in which a sensor is noisy; returns its path."""
        path = self.path(f"noisy_{seed}.yaml")
        with open(path, "w") as file:
            file.write(f"model: {CONFIG}/tractor.yaml\nduration_s: 1\nseed: {seed}\n"
                       "start: {inputs: {sensor.engine.noise_rpm: 20}}\n")
        return path

    def test_noise_is_replayed_and_gone_on_with_from_the_scenarios_seed(self):
        recording, snapshot = self.path("noisy.lcmlog"), self.path("half.lcmlog")
        noisy = self.noisy(7)
        whole = free("--record", recording, "--snapshot-at", "0.5", snapshot, scenario=noisy)
        with open(recording, "rb") as file:
            self.assertIn(b'"seed": 7', file.read())
        replayed = subprocess.run([SHIFTRIG, "replay", recording], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(replayed.returncode, 0, replayed.stderr + replayed.stdout)
        done = run("--from", snapshot, "--duration", "1", "--pace", "free", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        reading = "sensor.engine.speed_rad_s"
        self.assertEqual(json.loads(done.stdout.splitlines()[-1])["final"][reading], whole["final"][reading])
        self.assertNotEqual(free(scenario=self.noisy(8))["final"][reading], whole["final"][reading])

    # The Trace Event Format as chrome://tracing and ui.perfetto.dev read it.
    def assert_chrome_trace(self, trace, ticks):
        events = trace["traceEvents"]
        rows = {e["tid"]: e["args"]["name"] for e in events if e["ph"] == "M" and e["name"] == "thread_name"}
        spans = [e for e in events if e["ph"] == "X"]
        self.assertEqual(len(rows) + len(spans), len(events))
        for span in spans:
            self.assertIn(span["tid"], rows)
            self.assertGreaterEqual(span["ts"], 0)
            self.assertGreaterEqual(span["dur"], 0)
        self.assertEqual([e["args"]["slot"] for e in spans if e["name"] == "tick"], list(range(ticks)))

    def test_what_the_solver_says_of_itself_is_no_difference_of_machines(self):
        recording = self.path("shift.lcmlog")
        free("--record", recording)
        heavier, _ = self.tractor_with("vehicle:      {mass_kg: 14000", "vehicle:      {mass_kg: 14100")
        table = command("replay", recording, "--model", heavier)
        self.assertEqual(table.returncode, 0, table.stderr)
        signals = [line.split()[0] for line in table.stdout.splitlines()[1:]]
        deviations = [d["signal"] for d in json.loads(command("replay", recording, "--model", heavier, "--json").stdout)["deviations"]]
        self.assertIn("mass.vehicle.speed_m_s", signals)
        self.assertIn("energy.stored_j", deviations)
        for signal_name in signals + deviations:
            self.assertFalse(signal_name.startswith(("certificate.", "energy.defect")), signal_name)

    def test_a_recording_is_judged_as_its_run_was(self):
        recording = self.path("shift.lcmlog")
        judged = free("--record", recording)["shifts"]
        done = subprocess.run([SHIFTRIG, "report", recording, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["shifts"], judged)

    def test_candump_log_takes_the_controllers_place(self):
        log = self.path("shift.log")
        first = free("--can-log", log)
        second = free("--can-replay", log)
        self.assertEqual([(s["from"], s["to"], s["completed"]) for s in second["shifts"]], [("F2", "F3", True)])
        for one, other in zip(first["shifts"], second["shifts"]):
            self.assertAlmostEqual(one["ended_s"], other["ended_s"], delta=0.02)

    def test_a_log_that_does_not_fit_the_disk_fails_the_run(self):
        done = run("--scenario", SHIFT, "--pace", "free", "--can-log", "/dev/full")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("/dev/full: cannot be written: No space left on device", done.stderr.splitlines())

    def test_sigint_ends_the_run_with_everything_recorded(self):
        recording = self.path("cut.lcmlog")
        process = subprocess.Popen([SHIFTRIG, "run", "--scenario", SHIFT, "--pace", "wall", "--factor", "0.1", "--json",
                                    "--record", recording], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while not os.path.exists(recording) or os.path.getsize(recording) < 200000:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0, err)
        result = json.loads(out.splitlines()[-1])
        self.assertEqual(result["loop"]["outcome"], "stopped")
        self.assertLess(result["ticks"], 6000)
        replayed = subprocess.run([SHIFTRIG, "replay", recording, "--json"], stdout=subprocess.PIPE, text=True)
        self.assertEqual(replayed.returncode, 0)
        self.assertEqual(json.loads(replayed.stdout)["ticks"], result["ticks"])

    def stopped(self, *arguments, after, by=signal.SIGTERM):
        """The signal once `after()` holds; the result, and the seconds that the program still took."""
        process = subprocess.Popen([MULTICAST, SHIFTRIG, "run", "--scenario", SHIFT, "--json", *arguments],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        while not after():
            self.assertIsNone(process.poll())
            time.sleep(0.05)
        time.sleep(0.5)
        asked = time.monotonic()
        process.send_signal(by)
        out, err = process.communicate(timeout=60)
        took = time.monotonic() - asked
        self.assertEqual(process.returncode, 0, err)
        result = json.loads(out.splitlines()[-1])
        self.assertEqual(result["loop"]["outcome"], "stopped")
        return result, took

    def test_sigterm_ends_a_run_in_any_pace_whatever_it_waits_for(self):
        recording, started = self.path("cut.lcmlog"), self.path("started")
        recorded = lambda: os.path.exists(recording) and os.path.getsize(recording) > 0
        for arguments, ticks in (
                (("--pace", "wall", "--rate-hz", "1", "--factor", "0.001"), 1),  # sleeps 1000 s
                (("--pace", "lockstep", "--bus", "udpcan:239.74.163.2:43113", "--answer-timeout", "3600"), 10),  # a command cycle
                (("--pace", "free", "--duration", "1e9"), None),
                (("--pace", "wall", "--controller", "touch " + started + "; sleep 1000", "--bus", "inprocess", "--controller-start", "3600"), 0)):
            with self.subTest(arguments):
                begun = recorded if ticks != 0 else lambda: os.path.exists(started)
                result, took = self.stopped(*arguments, "--record", recording, after=begun)
                self.assertLess(took, 5 if ticks is None else 2)  # the ticks of a free run are judged, too
                if ticks is not None:
                    self.assertLessEqual(result["ticks"], ticks)
                replayed = subprocess.run([SHIFTRIG, "replay", recording, "--json"], stdout=subprocess.PIPE, text=True)
                self.assertEqual(replayed.returncode, 0)
                self.assertEqual(json.loads(replayed.stdout)["ticks"], result["ticks"])
                os.remove(recording)

    def test_the_end_of_the_terminal_ends_a_run_with_everything_kept(self):
        recording, table = self.path("cut.lcmlog"), self.path("cut.csv")
        recorded = lambda: os.path.exists(recording) and os.path.getsize(recording) > 200000
        result, _ = self.stopped("--factor", "0.1", "--record", recording, "--csv", table, after=recorded, by=signal.SIGHUP)
        with open(table) as file:
            self.assertEqual(len(file.readlines()), 1 + result["ticks"])
        replayed = command("replay", recording, "--json")
        self.assertEqual((replayed.returncode, json.loads(replayed.stdout)["ticks"]), (0, result["ticks"]))

    def test_nohup_outlives_the_terminal(self):
        recording = self.path("whole.lcmlog")
        process = subprocess.Popen(["nohup", SHIFTRIG, "run", "--scenario", SHIFT, "--factor", "4", "--json", "--record", recording],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while not os.path.exists(recording) or os.path.getsize(recording) < 200000:
            time.sleep(0.05)
        process.send_signal(signal.SIGHUP)
        out, err = process.communicate(timeout=60)
        self.assertEqual((process.returncode, json.loads(out.splitlines()[-1])["loop"]["outcome"]), (0, "completed"), err)

    def test_a_controller_that_is_no_program_ends_the_run_before_it_begins(self):
        began = time.monotonic()
        done = run("--scenario", SHIFT, "--bus", "inprocess", "--controller", "nixprog --now", "--controller-start", "60", "--json")
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertEqual(done.stderr, 'controller "nixprog --now" could not be started: there is no program nixprog\n')
        self.assertLess(time.monotonic() - began, 30)
        # What the shell has to be asked is known once it has tried.
        done = run("--scenario", SHIFT, "--bus", "inprocess", "--controller", "'nixprog'", "--controller-start", "0", "--json", "--factor", "4")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn('controller "\'nixprog\'" could not be started (status 127)', done.stderr.splitlines())
        self.assertEqual(json.loads(done.stdout)["ticks"], 6000)

    def test_a_run_that_does_not_begin_for_its_controller_leaves_its_files_as_they_were(self):
        with open(self.path("text"), "w") as file:
            file.write("#!/bin/sh\n")
        os.mkdir(self.path("folder"))
        for controller, why in (("nixprog", "there is no program nixprog"), (self.path("text"), self.path("text") + ": Permission denied"),
                                (self.path("none --x"), self.path("none") + ": No such file or directory"),
                                (self.path("folder"), self.path("folder") + ": Is a directory"), ("'nixprog'", None)):
            outputs = []
            for name in ("record.lcmlog", "table.csv", "trace.json", "can.log", "x.snap"):
                outputs.append(self.path(name))
                with open(outputs[-1], "w") as file:
                    file.write("mine")
            done = run("--scenario", SHIFT, "--bus", "inprocess", "--controller", controller, "--controller-start", "60", "--record", outputs[0],
                       "--csv", outputs[1], "--trace", outputs[2], "--can-log", outputs[3], "--snapshot-at", "1", outputs[4])
            self.assertEqual((done.returncode, done.stdout), (2, ""))
            if why:
                self.assertEqual(done.stderr, f'controller "{controller}" could not be started: {why}\n')
            else:
                self.assertEqual(done.stderr.splitlines()[-1], f'controller "{controller}" could not be started (status 127)')
            for name in outputs:
                with open(name) as file:
                    self.assertEqual(file.read(), "mine", (name, controller))
            self.assertEqual(len(os.listdir(self.folder)), 7)

    def test_a_test_whose_controller_is_none_or_ends_fails_at_once(self):
        junit = self.path("junit.xml")
        lockstep = [MULTICAST, SHIFTRIG, "test", SHIFT, "--pace", "lockstep", "--bus", "udpcan:239.74.163.2:43113",
                    "--answer-timeout", "60", "--junit", junit, "--controller"]
        tested = lambda *more: subprocess.run(lockstep + list(more), capture_output=True, text=True, timeout=240)
        began = time.monotonic()
        done = tested("nixprog")
        self.assertEqual((done.returncode, done.stdout, done.stderr),
                         (2, "", 'controller "nixprog" could not be started: there is no program nixprog\n'))
        self.assertFalse(os.path.exists(junit))
        done = tested("'nixprog'")
        self.assertEqual(done.returncode, 2)
        self.assertEqual(done.stdout.splitlines()[1:-1],
                         [f'     {SHIFT}: controller "\'nixprog\'" could not be started (status 127)'])
        for controller, start, ended in (("exit 3", "0", "ended with status 3"), ("exit 0", "0.2", "ended with status 0"),
                                         ("sleep 0.4; kill -9 $$", "0", "was ended by signal 9")):
            done = tested(controller, "--controller-start", start)
            self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
            told = done.stdout.splitlines()[1:-1]
            self.assertEqual(len(told), 1, done.stdout)
            self.assertRegex(told[0], "^     " + re.escape(SHIFT) + r": after [\d.]+ s of 6 s its controller \"" + re.escape(controller)
                             + '" ' + ended + "$")
        kept = self.path("plough_upshift.lcmlog")
        with open(kept, "w") as file:
            file.write("mine")
        done = tested("exit 3", "--record", self.folder)
        with open(kept) as file:
            self.assertEqual((done.returncode, file.read()), (1, "mine"))
        self.assertLess(time.monotonic() - began, 30)  # of 60 s for each answer

    def test_controller_that_ends_is_told_and_the_safe_command_acts(self):
        done = run("--scenario", SHIFT, "--bus", "inprocess", "--controller", "exit 3", "--pace", "wall", "--factor", "4",
                   "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn('controller "exit 3" ended with status 3', done.stderr)
        self.assertEqual(json.loads(done.stdout.splitlines()[-1])["final"]["rig.safe_command"], 1)

    def test_lockstep_says_once_that_nobody_answers(self):
        done = run("--scenario", SHIFT, "--bus", "inprocess", "--controller", "none", "--pace", "lockstep", "--duration", "0.5",
                   "--answer-timeout", "0.02", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        said = [line for line in done.stderr.splitlines() if "has not answered" in line]
        self.assertEqual(said, ["lockstep: the controller has not answered for 0.02 s (--answer-timeout); so long is waited "
                                "for each command cycle"])

    def test_nothing_but_the_result_where_there_is_no_terminal(self):
        done = run("--scenario", SHIFT, "--pace", "free")
        self.assertEqual(done.returncode, 0)
        self.assertNotIn("\r", done.stderr + done.stdout)


def at_wall_pace(*arguments, prefix=()):
    done = run("--scenario", SHIFT, "--pace", "wall", "--json", *arguments, prefix=prefix)
    return done, json.loads(done.stdout.splitlines()[-1])


class RealTime(InAFolder):
    # Two thousand times as fast as the clock: every tick is late.
    def test_too_many_late_ticks_in_a_row_end_the_run_where_that_is_asked_for(self):
        done, result = at_wall_pace("--factor", "2000", "--catch-up", "1000000", "--late-limit", "50", "--when-late", "abort")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(result["loop"]["outcome"], "late_too_often")
        self.assertEqual(result["loop"]["late_runs"], 1)
        self.assertGreaterEqual(result["loop"]["longest_late_run"], 50)
        self.assertLess(result["ticks"], 6000)

    def test_late_ticks_are_only_counted_where_nothing_else_is_asked_for(self):
        done, result = at_wall_pace("--factor", "2000", "--catch-up", "1000000", "--late-limit", "50")
        self.assertEqual(done.returncode, 0)
        self.assertEqual(result["ticks"], 6000)
        self.assertGreater(result["loop"]["late_runs"], 10)

    def test_too_far_behind_ends_the_run_or_skips_as_asked_for(self):
        done, result = at_wall_pace("--factor", "2000", "--catch-up", "10", "--overrun", "abort")
        self.assertEqual((done.returncode, result["loop"]["outcome"]), (1, "too_far_behind"))
        done, result = at_wall_pace("--factor", "2000", "--catch-up", "10")
        self.assertEqual((done.returncode, result["loop"]["outcome"]), (0, "completed"))
        self.assertGreater(result["loop"]["skipped"], 0)
        self.assertEqual(result["loop"]["executed"] + result["loop"]["skipped"], 6000)

    def test_without_privileges_it_runs_and_says_once_what_it_lacks_and_what_would_grant_it(self):
        prefix = ["prlimit", "--memlock=65536:65536", "--rtprio=0:0"]
        if os.geteuid() == 0:
            prefix += ["setpriv", "--bounding-set=-all", "--inh-caps=-all"]
        recording = self.path("poor.lcmlog")
        done, result = at_wall_pace("--factor", "4", "--record", recording, prefix=prefix)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(result["loop"]["executed"] + result["loop"]["skipped"], 6000)
        with open(recording, "rb") as file:
            kept = file.read().decode(errors="replace")
        for lacking in ("locked memory", "FIFO priority 80 for the plant thread"):
            lines = [line for line in done.stderr.splitlines() if lacking in line]
            self.assertEqual(len(lines), 1, done.stderr)
            self.assertIn("; to grant it: sudo setcap cap_sys_nice,cap_ipc_lock+ep ", lines[0])
            self.assertEqual([r["remedy"].startswith("sudo setcap") for r in result["not_granted"] if lacking in r["what"]], [True])
            self.assertIn(lacking, kept)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[4:]])
