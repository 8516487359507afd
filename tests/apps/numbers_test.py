"""Every number that a program takes on its command line: what is none, or out of bounds, is refused in one line.

Options are taken from --help, so that one that is added is tried, too.

usage: numbers_test.py SHIFTRIG CONFIG [PROGRAM]...
"""
import re
import subprocess
import sys
import unittest

SHIFTRIG, CONFIG, OTHERS = sys.argv[1], sys.argv[2], sys.argv[3:]
NOT_NUMBERS = ("nan", "-nan", "inf", "-inf", "1e400", "-1e400", "1e300", "-1", "", "ten", "1x")
ZERO_IS_SENSELESS = {"--duration", "--rate-hz", "--substeps", "--factor", "--answer-timeout", "--step", "--branches",
                     "--top", "--jobs", "--shift", "--width", "--hours"}
WITH_A_RULE = {"--duration", "--rate-hz", "--substeps", "--factor", "--catch-up", "--late-limit", "--answer-timeout", "--priority",
               "--rehearse", "--cpu", "--snapshot-at", "--controller-start", "--port", "--jobs", "--tolerance", "--step",
               "--branches", "--seed", "--threads", "--top", "--shift", "--from", "--until", "--width"}


def run(*command):
    return subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=20)


def numeric_options(*command):
    """(name, is it whole) of every option with a number."""
    for line in run(*command, "--help").stdout.splitlines():
        found = re.match(r"\s+(?:-\w,)?(--[-\w]+)\S* \[?(FLOAT|U?INT)\b", line)
        if found:
            yield found[1], found[2] != "FLOAT"


def commands():
    names = re.findall(r"^  ([a-z-]+) ", run(SHIFTRIG, "--help").stdout.split("Subcommands:")[1], re.M)
    return [(SHIFTRIG, name) for name in names] + [(program,) for program in OTHERS]


class Numbers(unittest.TestCase):
    def assert_refused(self, command, option, written, *more):
        done = run(*command, option, written, *more)
        said = (" ".join((*command[1:], option, written)), done.stderr)
        self.assertEqual(done.returncode, 2, said)
        self.assertEqual(done.stdout, "", said)
        self.assertRegex(done.stderr.splitlines()[0], re.escape(option) + ".*" + re.escape(written), said)
        self.assertLessEqual(len(done.stderr.splitlines()), 1 if command[0] == SHIFTRIG else 2, said)

    def test_what_is_no_number_in_its_bounds_is_refused_everywhere(self):
        seen = set()
        for command in commands():
            for option, is_whole in numeric_options(*command):
                seen.add(option)
                more = ("file",) if option == "--snapshot-at" else ()
                zero = ("0",) if option in ZERO_IS_SENSELESS else ()
                for value in NOT_NUMBERS + zero + (("1.5", "0x1p3") if is_whole else ("0x1p-3",)):
                    with self.subTest(" ".join((*command[1:], option, value))):
                        self.assert_refused(command, option, value, *more)
        self.assertEqual(seen - {"--hours"}, WITH_A_RULE)

    def test_the_message_names_option_value_and_rule(self):
        for command, option, value, message in (
                ("run", "--duration", "nan", "--duration: nan; must be > 0 and at most 1e+09"),
                ("run", "--priority", "100", "--priority: 100; must be a whole number within 0 and 99"),
                ("replay", "--tolerance", "nan", "--tolerance: nan; must be within 0 and 1e+06")):
            self.assertEqual(run(SHIFTRIG, command, option, value).stderr, message + "\n")

    def test_numbers_in_name_and_value(self):
        for value in ("nan", "inf", "1e400", "1x"):
            self.assert_refused((SHIFTRIG, "statics", CONFIG + "/two_mass.yaml"), "--input", "engine=" + value)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
