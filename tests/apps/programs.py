"""The programs under test, which the command line names: SHIFTRIG SHIFTRIG_TCU CONFIG."""
import json
import os
import subprocess
import sys

from in_a_folder import Folder

SHIFTRIG, TCU, CONFIG = sys.argv[1:4]
SHIFT = CONFIG + "/scenarios/plough_upshift.yaml"
MULTICAST = os.path.dirname(os.path.abspath(__file__)) + "/../io/with_multicast.sh"


def run(*arguments, program=SHIFTRIG, prefix=(), **options):
    command = [*prefix, program, *(["run"] if program == SHIFTRIG else []), *arguments]
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=240, **options)


def command(*arguments):
    return subprocess.run([SHIFTRIG, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=240)


def free(*arguments, scenario=SHIFT):
    done = run("--scenario", scenario, "--pace", "free", "--json", *arguments)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


class InAFolder(Folder):
    def tractor_with(self, old, new):
        """The tractor's file, changed in one place; returns its path and the line of the change."""
        with open(CONFIG + "/tractor.yaml") as file:
            text = file.read()
        self.assertIn(old, text)
        line = text[: text.index(old)].count("\n") + 1
        text = text.replace(old, new, 1).replace("can/tractor.yaml", CONFIG + "/can/tractor.yaml")
        with open(self.path("tractor.yaml"), "w") as file:
            file.write(text)
        return self.path("tractor.yaml"), line
