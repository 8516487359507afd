"""The files that the commands of `shiftrig` are given: outputs that are inputs, that clash, that cannot be written, and
recordings and results that are not whole.

usage: files_test.py SHIFTRIG CONFIG
"""
import json
import os
import shutil
import signal
import subprocess
import sys
import time
import unittest

from in_a_folder import Folder

SHIFTRIG, CONFIG = map(os.path.abspath, sys.argv[1:3])
SHIFT = CONFIG + "/scenarios/plough_upshift.yaml"
TRACTOR = CONFIG + "/tractor.yaml"


class Commands(Folder):
    """In a folder of their own, in which the files are called by their names alone."""

    def shiftrig(self, *arguments, **options):
        return subprocess.run([SHIFTRIG, *arguments], capture_output=True, text=True, timeout=240, cwd=self.folder, **options)

    def recorded(self, *arguments, name="u.lcmlog"):
        done = self.shiftrig("run", "--scenario", SHIFT, "--pace", "free", "--record", name, *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return name

    def cut(self, recording, share, name="cut.lcmlog"):
        with open(self.path(recording), "rb") as file:
            data = file.read()
        with open(self.path(name), "wb") as file:
            file.write(data[: int(share * len(data))])
        return name

    def contents(self):
        found = {}
        for folder, _, names in os.walk(self.folder):
            for name in filter(lambda name: os.path.exists(os.path.join(folder, name)), names):  # not a link to nothing
                with open(os.path.join(folder, name), "rb") as file:
                    found[os.path.join(folder, name)] = file.read()
        return found

    def assert_refused(self, line, *arguments):
        """One line, exit code 2, and no file made, changed or gone."""
        before = self.contents()
        done = self.shiftrig(*arguments)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (2, "", line + "\n"), arguments)
        self.assertEqual(self.contents(), before, arguments)


class Outputs(Commands):
    def test_no_output_overwrites_an_input(self):
        self.recorded("--duration", "0.5", "--snapshot-at", "0.2", "s.snap")
        shutil.copy(CONFIG + "/two_mass.yaml", self.path("m.yaml"))
        shutil.copy(SHIFT, self.path("s.yaml"))
        os.symlink("u.lcmlog", self.path("linked.svg"))
        os.link(self.path("u.lcmlog"), self.path("hard.html"))
        for option, line in (
                (("export", "u.lcmlog", "--csv", "u.lcmlog"), "--csv u.lcmlog: is the file of RECORDING"),
                (("export", "u.lcmlog", "--mcap", "./u.lcmlog"), "--mcap ./u.lcmlog: is the file of RECORDING (u.lcmlog)"),
                (("export", "u.lcmlog", "--candump", "u.lcmlog"), "--candump u.lcmlog: is the file of RECORDING"),
                (("report", "u.lcmlog", "-o", "hard.html"), "--output hard.html: is the file of RECORDING (u.lcmlog)"),
                (("plot", "u.lcmlog", "-o", "linked.svg"), "--output linked.svg: is the file of RECORDING (u.lcmlog)"),
                (("run", "m.yaml", "--record", "m.yaml"), "--record m.yaml: is the file of MODEL"),
                (("run", "m.yaml", "--csv", "m.yaml"), "--csv m.yaml: is the file of MODEL"),
                (("run", "m.yaml", "--trace", "m.yaml"), "--trace m.yaml: is the file of MODEL"),
                (("run", "--scenario", "s.yaml", "--can-log", "s.yaml"), "--can-log s.yaml: is the file of --scenario"),
                (("run", "--from", "s.snap", "--record", "s.snap"), "--record s.snap: is the file of --from"),
                (("serve", "m.yaml", "--record", "m.yaml"), "--record m.yaml: is the file of MODEL"),
                (("check", "m.yaml", "--svg", "m.yaml"), "--svg m.yaml: is the file of MODEL"),
                (("test", "s.yaml", "--junit", "s.yaml"), "--junit s.yaml: is the file of SCENARIO")):
            self.assert_refused(line + ", which it would overwrite", *option)

    def test_what_a_scenario_and_a_controller_read_is_not_overwritten_either(self):
        shutil.copytree(CONFIG, self.path("config"))
        scenario, model, calibration = "config/scenarios/plough_upshift.yaml", "config/tractor.yaml", "config/calibration/bad.yaml"
        snapshot = self.shiftrig("run", "--scenario", scenario, "--pace", "free", "--snapshot-at", "1", "s.snap")
        self.assertEqual(snapshot.returncode, 0, snapshot.stderr)
        self.assert_refused(f"--record {model}: is the file of the model, which it would overwrite",
                            "run", "--from", "s.snap", "--record", model)
        for arguments, output, what in ((("run",), model, "the model"), (("serve",), model, "the model"),
                                        (("run",), "config/can/tractor.yaml", "the CAN mapping"),
                                        (("run",), "config/can/shiftrig.dbc", "the mapping's DBC"),
                                        (("run", "--controller", "builtin:" + calibration), calibration, "the controller's calibration")):
            self.assert_refused(f"--record {output}: is the file of {what}, which it would overwrite",
                                *arguments, "--scenario", scenario, "--record", output)

    def test_what_a_machine_reads_is_not_overwritten_by_other_commands(self):
        shutil.copytree(CONFIG, self.path("cfg"))
        name = "u.lcmlog"
        self.shiftrig("run", "--scenario", "cfg/scenarios/plough_upshift.yaml", "--pace", "free", "--record", name)
        for command in (("test", "cfg/scenarios/plough_upshift.yaml", "--junit", "cfg/tractor.yaml"),
                        ("export", name, "--candump", "cfg/can/shiftrig.dbc"),
                        ("check", "cfg/tractor.yaml", "--svg", "cfg/can/tractor.yaml")):
            with open(self.path(command[-1]), "rb") as file:
                before = file.read()
            done = self.shiftrig(*command)
            self.assertEqual(done.returncode, 2, command)
            self.assertIn("which it would overwrite", done.stderr)
            with open(self.path(command[-1]), "rb") as file:
                self.assertEqual(file.read(), before, command)

    def test_a_compressed_recording_is_replayed(self):
        name = self.recorded(name="u.lcmlog.zst")
        done = self.shiftrig("replay", name)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("ticks agree bit for bit", done.stdout)

    def test_a_log_without_frames_is_told(self):
        with open(self.path("empty.log"), "w"):
            pass
        done = self.shiftrig("run", "--scenario", SHIFT, "--pace", "free", "--can-replay", "empty.log")
        self.assertEqual(done.returncode, 2)
        self.assertIn("has no frames", done.stderr)

    def test_no_two_outputs_are_one_file(self):
        self.recorded("--duration", "0.5")
        os.symlink("not_yet.csv", self.path("link"))
        for arguments, line in (
                (("export", "u.lcmlog", "--csv", "q", "--mcap", "q"), "--mcap q: is the file of --csv"),
                (("run", TRACTOR, "--record", "q", "--csv", "./q"), "--csv ./q: is the file of --record (q)"),
                (("run", TRACTOR, "--record", "link", "--csv", "not_yet.csv"), "--csv not_yet.csv: is the file of --record (link)"),
                (("run", TRACTOR, "--snapshot-at", "1", "z", "--record", "z"), "--snapshot-at z: is the file of --record"),
                (("check", TRACTOR, "--svg", "z", "--dot", "z"), "--svg z: is the file of --dot")):
            self.assert_refused(line + ", too; each needs its own", *arguments)
        os.mkdir(self.path("kept"))
        shutil.copy(SHIFT, self.path("one.yaml"))
        self.assert_refused("--record kept/one.lcmlog: is the file of --junit, too; each needs its own",
                            "test", "one.yaml", "--record", "kept", "--junit", "kept/one.lcmlog")
        done = self.shiftrig("check", TRACTOR, "--svg", "/dev/null", "--dot", "/dev/null")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_one_export_may_go_to_standard_output_in_any_format(self):
        self.recorded("--duration", "0.5")
        for option in ("--csv", "--mcap", "--candump"):
            done = subprocess.run([SHIFTRIG, "export", self.path("u.lcmlog"), option, "-"], capture_output=True, cwd=self.folder)
            self.shiftrig("export", "u.lcmlog", option, "file")
            with open(self.path("file"), "rb") as file:
                self.assertEqual((done.returncode, done.stderr, done.stdout == file.read()), (0, b"", True), option)
        self.assert_refused("--mcap -: standard output is taken by --csv", "export", "u.lcmlog", "--csv", "-", "--mcap", "-")
        self.assert_refused("--record: - is standard output, which this cannot go to; ./- is a file of that name",
                            "run", TRACTOR, "--record", "-")

    def test_a_name_is_not_empty(self):
        for arguments in (("run", TRACTOR, "--csv"), ("run", TRACTOR, "--record"), ("run", TRACTOR, "--trace"),
                          ("run", TRACTOR, "--can-log"), ("run", TRACTOR, "--snapshot-at", "1"), ("run", TRACTOR, "--scenario"),
                          ("run", "--from"), ("test", SHIFT, "--junit"), ("test", SHIFT, "--limits"), ("check", TRACTOR, "--svg"),
                          ("check", TRACTOR, "--dot"), ("report", TRACTOR, "-o"), ("export", TRACTOR, "--mcap"),
                          ("serve", TRACTOR, "--record"), ("plot", TRACTOR, "-o")):
            option = {"-o": "--output", "1": "--snapshot-at"}.get(arguments[-1], arguments[-1])
            self.assert_refused(option + ": must name a file", *arguments, "")

    def test_what_cannot_be_written_is_told_before_the_run(self):
        for option in (("--record",), ("--csv",), ("--trace",), ("--can-log",), ("--snapshot-at", "1")):
            self.assert_refused("/nosuch/x: cannot be written: No such file or directory", "run", "--scenario", SHIFT, *option, "/nosuch/x")
            self.assert_refused("/tmp: cannot be written: Is a directory", "run", "--scenario", SHIFT, *option, "/tmp")
        self.assert_refused("/dev/null/x: cannot be written: Not a directory", "check", TRACTOR, "--svg", "/dev/null/x")

    def test_a_snapshot_is_of_a_time_within_the_run(self):
        self.assert_refused("shiftrig: --snapshot-at 99: the run ends at 6 s",
                            "run", "--scenario", SHIFT, "--pace", "free", "--snapshot-at", "99", "x.snap")
        self.recorded("--snapshot-at", "1", "one.snap")
        self.assert_refused("shiftrig: --snapshot-at 0.5: the run goes on from 1 s",
                            "run", "--from", "one.snap", "--pace", "free", "--snapshot-at", "0.5", "x.snap")
        done = self.shiftrig("run", "--from", "one.snap", "--pace", "free", "--snapshot-at", "6", "end.snap")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(os.path.exists(self.path("end.snap")))

    def test_a_snapshot_that_cannot_be_written_spares_the_result(self):
        done = self.shiftrig("run", "--scenario", SHIFT, "--pace", "free", "--json", "--snapshot-at", "1", "/dev/full")
        self.assertEqual(done.returncode, 1)
        self.assertIn("/dev/full: cannot be written: No space left on device\n", done.stderr)
        self.assertEqual(json.loads(done.stdout)["ticks"], 6000)

    def test_results_that_standard_output_does_not_take_are_told(self):
        self.recorded("--snapshot-at", "2.14", "s.snap")
        for arguments in (("check", TRACTOR), ("check", TRACTOR, "--json"), ("check", "--help"), ("--version",),
                          ("statics", TRACTOR, "--closed", "Fc,F2", "--input", "engine=100"), ("explain", "u.lcmlog"),
                          ("replay", "u.lcmlog"), ("run", "--scenario", SHIFT, "--pace", "free", "--json"), ("test", SHIFT),
                          ("compare", "u.lcmlog", "u.lcmlog", "--json"), ("fork", "s.snap", "--vary", "clutch.F3.leak=0,0.1"),
                          ("export", "u.lcmlog", "--csv", "-"), ("export", "u.lcmlog", "--mcap", "-"), ("report", "u.lcmlog", "--json")):
            with open("/dev/full", "w") as full:
                done = subprocess.run([SHIFTRIG, *arguments], stdout=full, stderr=subprocess.PIPE, text=True, cwd=self.folder)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertRegex(done.stderr, r"(?m)^(shiftrig: standard output|-:) cannot be written(: No space left on device)?$", arguments)

    def test_a_closed_standard_output_does_not_become_a_file(self):
        done = subprocess.run(["sh", "-c", '"$0" check "$1" --svg out.svg >&-', SHIFTRIG, CONFIG + "/two_mass.yaml"], capture_output=True, text=True,
                              cwd=self.folder)
        self.assertEqual((done.returncode, done.stderr), (2, "shiftrig: standard output cannot be written: Bad file descriptor\n"))
        with open(self.path("out.svg")) as file:
            self.assertTrue(file.read().startswith("<svg"))


    def test_a_picture_takes_no_file_of_a_similar_name(self):
        self.recorded("--duration", "0.5")
        with open(self.path("p.png.svg"), "w") as file:
            file.write("mine")
        done = self.shiftrig("plot", "u.lcmlog", "-o", "p.png")  # also where there is no rsvg-convert
        with open(self.path("p.png.svg")) as file:
            self.assertEqual(file.read(), "mine")
        self.assertEqual(sorted(set(os.listdir(self.folder)) - {"p.png"}), ["p.png.svg", "u.lcmlog"], done.stderr)


    def test_a_table_goes_straight_into_a_pipe(self):
        """No file is made beside what has no place of its own: a pipe, a device, a stream of this program."""
        os.mkdir(self.path("tmp"))
        there = dict(os.environ, TMPDIR=self.path("tmp"))
        arguments = [SHIFTRIG, "run", "--scenario", SHIFT, "--pace", "free", "--duration", "0.5", "--csv"]
        subprocess.run(arguments + ["table.csv"], check=True, capture_output=True, cwd=self.folder)
        with open(self.path("table.csv")) as file:
            table = file.read()
        os.mkdir(self.path("pipes"))
        os.mkfifo(self.path("pipes/fifo"))
        writer = subprocess.Popen(arguments + ["pipes/fifo"], stdout=subprocess.DEVNULL, cwd=self.folder, env=there)
        seen = set()
        while not os.listdir(self.path("tmp")):  # the recording of which the table is made
            seen |= set(os.listdir(self.path("pipes")))
            self.assertIsNone(writer.poll(), seen)
        with open(self.path("pipes/fifo")) as file:
            self.assertEqual(file.read(), table)
        self.assertEqual(writer.wait(), 0)
        self.assertEqual(seen | set(os.listdir(self.path("pipes"))), {"fifo"})
        done = subprocess.run(arguments + ["/dev/stdout"], stdout=subprocess.PIPE, text=True, cwd=self.folder, env=there)
        self.assertEqual((done.returncode, done.stdout[:len(table)] == table), (0, True))
        with open(self.path("table.txt"), "w") as file:  # into which the run's summary goes, too: behind it
            subprocess.run(arguments + ["/dev/stdout"], check=True, stdout=file, cwd=self.folder, env=there)
        with open(self.path("table.txt")) as file:
            text = file.read()
        self.assertEqual((text[:len(table)] == table, text[len(table):].split(",")[0]), (True, "500 ticks"))
        done = subprocess.run(arguments + ["/dev/null"], stdout=subprocess.DEVNULL, cwd=self.folder, env=there)
        self.assertEqual((done.returncode, os.listdir(self.path("tmp"))), (0, []))
        # A stream that was sent into a file is one: the table is made beside that, not in /dev.
        with open(self.path("pipes/table"), "w") as file:
            done = subprocess.run(arguments + ["/dev/fd/%d" % file.fileno()], stdout=subprocess.DEVNULL, cwd=self.folder, env=there,
                                  pass_fds=[file.fileno()])
        with open(self.path("pipes/table")) as file:
            self.assertEqual((done.returncode, file.read() == table), (0, True))
        os.remove(self.path("pipes/fifo"))
        self.assert_refused("shiftrig: --csv: is made of the recording, which /dev/null does not keep",
                            *arguments[1:], "x.csv", "--record", "/dev/null")

    def test_what_is_in_a_name_does_not_break_the_line(self):
        name, shown = "u\n\x1b[31m.lcmlog", r"u\n\x1b[31m.lcmlog"
        self.recorded("--duration", "0.5", name=name)
        os.mkdir(self.path("a\nb"))
        self.assert_refused(f"--csv {shown}: is the file of RECORDING, which it would overwrite", "export", name, "--csv", name)
        self.assert_refused(r"--csv q\nr: is the file of --record, too; each needs its own", "run", TRACTOR, "--record", "q\nr", "--csv", "q\nr")
        self.assert_refused(r"a\nb: cannot be written: Is a directory", "run", TRACTOR, "--record", "a\nb")
        self.assert_refused(r"shiftrig: scenario no\nne is given twice", "test", "no\nne", "no\nne")
        cut = self.cut(name, 0.4, name="cut\n.lcmlog")
        done = self.shiftrig("explain", cut)
        self.assertRegex(done.stderr, r"^cut\\n\.lcmlog: is cut short.*\n$")
        done = self.shiftrig("replay", name)
        self.assertRegex(done.stdout, r"^u\\n\\x1b\[31m\.lcmlog: 500 ticks agree.*\n$")
        done = self.shiftrig("run", TRACTOR, "a\nb")
        self.assertEqual((done.returncode, done.stderr.splitlines()[0]), (2, r"The following argument was not expected: a\nb"))


class NotWhole(Commands):
    def test_half_a_recording_is_compared_with_nothing(self):
        whole = self.recorded()
        cut = self.cut(whole, 0.4)
        told = self.shiftrig("explain", cut)
        self.assertEqual(told.returncode, 2)
        line = told.stderr.rstrip("\n")
        self.assertRegex(line, r"^cut\.lcmlog: is cut short after tick \d+")
        for arguments in ((cut, whole), (whole, cut)):
            self.assert_refused(line + "; only whole runs are compared", "compare", *arguments)
        os.mkdir(self.path("folder"))
        shutil.move(self.path(cut), self.path("folder/u.lcmlog"))
        done = self.shiftrig("compare", "folder", whole)
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertRegex(done.stderr, r"^folder/u\.lcmlog: is cut short after tick \d+.*; only whole runs are compared\n$")

    def test_a_picture_and_a_report_of_half_a_recording_say_so(self):
        cut = self.cut(self.recorded(), 0.4)
        for arguments, output in ((("plot", cut, "-o", "p.svg"), "p.svg"), (("report", cut, "-o", "r.html"), "r.html")):
            done = self.shiftrig(*arguments)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertRegex(done.stderr, r"^cut\.lcmlog: is cut short after tick \d+, within a record\n$")
            self.assertGreater(os.path.getsize(self.path(output)), 1000)

    def test_a_run_that_was_stopped_is_compared_with_nothing(self):
        process = subprocess.Popen([SHIFTRIG, "run", "--scenario", SHIFT, "--factor", "0.1", "--json", "--record", "u.lcmlog"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=self.folder)
        while not os.path.exists(self.path("u.lcmlog")) or os.path.getsize(self.path("u.lcmlog")) < 200000:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        with open(self.path("stopped.json"), "w") as file:
            file.write(process.communicate(timeout=60)[0])
        done = self.shiftrig("run", "--scenario", SHIFT, "--pace", "free", "--json")
        with open(self.path("whole.json"), "w") as file:
            file.write(done.stdout)
        for arguments in (("whole.json", "stopped.json"), ("stopped.json", "whole.json")):
            self.assert_refused('stopped.json: run "stopped" did not come to its end (outcome "stopped"); only whole runs are compared',
                                "compare", *arguments)
        self.assertEqual(self.shiftrig("compare", "whole.json", "whole.json").returncode, 0)
        # Its recording is sound, and says the same.
        whole, line = self.recorded(name="whole.lcmlog"), 'u.lcmlog: its run did not come to its end (outcome "stopped")'
        for arguments in (("u.lcmlog", whole), (whole, "u.lcmlog"), ("u.lcmlog", "whole.json")):
            self.assert_refused(line + "; only whole runs are compared", "compare", *arguments)
        for command in (("explain",), ("replay",), ("replay", "--json"), ("report", "--json"), ("report", "-o", "r.html")):
            done = self.shiftrig(command[0], "u.lcmlog", *command[1:])
            self.assertEqual((done.returncode, done.stderr), (0, line + "\n"), command)
            done = self.shiftrig(command[0], whole, *command[1:])
            self.assertEqual((done.returncode, done.stderr), (0, ""), command)
        for recording, outcome in (("u.lcmlog", "stopped"), (whole, "completed")):
            self.assertEqual(json.loads(self.shiftrig("replay", recording, "--json").stdout)["outcome"], outcome)

    def test_a_recording_of_a_run_that_gave_up_is_compared_with_nothing(self):
        done = self.shiftrig("run", "--scenario", SHIFT, "--factor", "10000", "--catch-up", "0", "--overrun", "abort",
                             "--record", "u.lcmlog")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assert_refused('u.lcmlog: its run did not come to its end (outcome "too_far_behind"); only whole runs are compared',
                            "compare", "u.lcmlog", self.recorded(name="whole.lcmlog"))

    def test_runs_that_are_not_whole_are_named_and_the_rest_is_compared(self):
        for name in ("one", "two", "wrong"):
            with open(SHIFT) as file, open(self.path(name + ".yaml"), "w") as copy:
                copy.write(file.read().replace("../tractor.yaml", TRACTOR) + ("colour: red\n" if name == "wrong" else ""))
        tested = self.shiftrig("test", "one.yaml", "two.yaml", "wrong.yaml", "--json")
        self.assertEqual(tested.returncode, 2)
        with open(self.path("before.json"), "w") as file:
            file.write(tested.stdout)
        result = json.loads(tested.stdout)
        result["runs"][0]["loop"]["outcome"] = "too_far_behind"
        result["runs"][1]["shifts"][0]["duration_s"] *= 2
        with open(self.path("after.json"), "w") as file:
            json.dump(result, file)
        done = self.shiftrig("compare", "before.json", "after.json")
        unknown = r'run "wrong" could not be judged: wrong\.yaml:\d+:1: colour is not a known key.*\n'
        self.assertEqual(done.returncode, 2)
        self.assertRegex(done.stderr, "^before\\.json: " + unknown + 'after\\.json: run "one" did not come to its end '
                         r'\(outcome "too_far_behind"\); only whole runs are compared\n' + "after\\.json: " + unknown + "$")
        self.assertRegex(done.stdout, r"^two F2->F3: duration_s .*, worse\n1 shifts compared, 1 differences for the worse; "
                         r"runs not compared: 2\n$")
        listed = json.loads(self.shiftrig("compare", "before.json", "after.json", "--json").stdout)
        self.assertEqual(([d["run"] for d in listed["differences"]], [n["run"] for n in listed["not_compared"]]),
                         (["two"], ["one", "wrong"]))
        # Of a folder, too.
        os.mkdir(self.path("kept"))
        whole = self.recorded(name="kept/whole.lcmlog")
        self.cut(whole, 0.4, name="kept/cut.lcmlog")
        self.cut(whole, 0.001, name="kept/stub.lcmlog")
        done = self.shiftrig("compare", "kept", "kept")
        self.assertEqual((done.returncode, done.stdout), (2, "1 shifts compared, 0 differences for the worse; runs not compared: 2\n"))
        self.assertRegex(done.stderr, r"^(kept/cut\.lcmlog: is cut short after .*\nkept/stub\.lcmlog: is cut short within .*\n){2}$")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[3:]])
