"""Malformed requests, crowds, deaf viewers, foreign pages and wrong tokens against the dashboard of a running rig: each is
refused in words, and the rig does not lose a tick by it.

usage: serve_attack_test.py SHIFTRIG SOURCE_FOLDER
"""
import json
import random
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

RIG, SOURCE = sys.argv[1:3]
SECONDS = 10
TOKEN = "the-right-one"


class Served:
    """A rig at wall pace behind its dashboard, for ten seconds. It may be a second behind before it skips a tick: what the
    machine does to it for so long is not the question, what viewers could do would go on."""

    def __init__(self, folder, *arguments):
        self.recording = folder + "/served.lcmlog"
        self.process = subprocess.Popen([RIG, "serve", "--scenario", SOURCE + "/config/scenarios/plough_upshift.yaml", "--duration",
                                         str(SECONDS), "--port", "0", "--catch-up", "1000", "--record", self.recording, *arguments],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        self.port = int(re.search(r"127\.0\.0\.1:(\d+)", line).group(1))

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.port), timeout=5)

    def ask(self, request):
        """The answer to a request, as far as it comes within five seconds."""
        try:
            with self.connect() as connection:
                connection.sendall(request.encode("latin-1"))
                answer = b""
                while b"\r\n\r\n" not in answer and (part := connection.recv(65536)):
                    answer += part
                length = re.search(rb"(?i)content-length: (\d+)", answer)
                while length and len(answer.split(b"\r\n\r\n", 1)[1]) < int(length.group(1)) and (part := connection.recv(65536)):
                    answer += part
                return answer.decode("latin-1")
        except OSError:
            return ""

    def head(self, line, *more):
        return "\r\n".join([line, "Host: 127.0.0.1:%d" % self.port, *more, "", ""])

    def post(self, *headers, body='{"signal": "driver.throttle", "value": 0.1}', path="/api/input"):
        return self.ask(self.head("POST %s HTTP/1.1" % path, "Content-Length: %d" % len(body), *headers) + body)

    def end(self):
        out, err = self.process.communicate(timeout=120)
        assert self.process.returncode == 0, err
        return out


class Attacked(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def assert_no_tick_is_missing(self, rig, out, throttle):
        ticks = 1000 * SECONDS
        self.assertIn("%d executed, 0 skipped" % ticks, out)
        done = subprocess.run([RIG, "replay", rig.recording, "--json"], stdout=subprocess.PIPE, text=True)
        found = json.loads(done.stdout)
        self.assertEqual((found["agrees"], found["ticks"], found["lost"]), (True, ticks, 0))
        subprocess.run([RIG, "export", rig.recording, "--csv", self.folder + "/served.csv"], check=True, stderr=subprocess.DEVNULL)
        with open(self.folder + "/served.csv", encoding="utf-8") as file:
            head, *rows = [line.rstrip("\n").split(",") for line in file]
        column = head.index("driver.throttle")
        # A command that comes before the first tick leaves nothing of what was before it.
        self.assertLessEqual({float(row[column]) for row in rows}, set(throttle))
        self.assertEqual(float(rows[-1][column]), throttle[-1])

    def test_nobody_without_the_right_to_it_moves_the_rig(self):
        rig = Served(self.folder)
        own = "Content-Type: application/json"
        for answer, status in [
            (rig.post(own, "Origin: http://evil.example"), 403),
            (rig.post(own, "Sec-Fetch-Site: cross-site"), 403),
            (rig.post(own, "Origin: null"), 403),
            (rig.post("Content-Type: text/plain"), 403),
            (rig.ask("GET /api/model HTTP/1.1\r\nHost: evil.example\r\n\r\n"), 403),
            (rig.post(own, body="x" * 5000), 413),
            (rig.post(own, body="{"), 400),
            (rig.post(own, body="[1, 2]"), 400),
            (rig.post(own, body='{"signal": "driver.throttle", "value": "much"}'), 400),
            (rig.post(own, body='{"signal": "mass.engine.speed", "value": 1}'), 400),
            (rig.post(own, body='{"signal": "nothing", "value": 1}'), 400),
            (rig.post(own, body="[" * 4000), 400),
            (rig.post(own, path="/api/nothing"), 400),
            (rig.ask(rig.head("GET /../../etc/passwd HTTP/1.1")), 404),
        ]:
            self.assertRegex(answer, r"^HTTP/1\.1 %d " % status)
            self.assertGreater(len(answer.split("\r\n\r\n", 1)[1].strip()), 10, answer)
        self.assert_no_tick_is_missing(rig, rig.end(), [0.7281])

    def test_malformed_requests_crowds_and_deaf_viewers_do_not_slow_it(self):
        rig = Served(self.folder)
        until = time.time() + SECONDS - 2
        noise = random.Random(7)
        held = []

        def throw():  # bytes that are no request
            while time.time() < until:
                try:
                    with rig.connect() as connection:
                        kind = noise.randrange(4)
                        text = [noise.randbytes(noise.randrange(1, 3000)), b"GET " + b"/" * 9000 + b" HTTP/1.1\r\n\r\n",
                                b"POST /api/input HTTP/1.1\r\nContent-Length: -5\r\n\r\n",
                                b"GET /api/live HTTP/9.9\r\n" + b"X: y\r\n" * 500][kind]
                        connection.sendall(text)
                        if kind < 3:
                            connection.shutdown(socket.SHUT_WR)
                            connection.recv(4096)
                except OSError:
                    pass

        def view():  # asks for the stream and never reads
            for _ in range(4):
                connection = rig.connect()
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
                connection.sendall(rig.head("GET /api/live HTTP/1.1").encode())
                held.append(connection)

        def crowd():  # connects and says nothing
            for _ in range(200):
                connection = socket.socket()
                connection.setblocking(False)
                connection.connect_ex(("127.0.0.1", rig.port))
                held.append(connection)

        threads = [threading.Thread(target=each) for each in (throw, throw, view, crowd)]
        for thread in threads:
            thread.start()
        # The owner is still heard: one command, between all of it.
        answer = ""
        while not answer.startswith("HTTP/1.1 200") and time.time() < until + 1.5:
            answer = rig.post("Content-Type: application/json", body='{"signal": "driver.throttle", "value": 0.6}')
        self.assertRegex(answer, r"^HTTP/1\.1 200 ")
        for thread in threads:
            thread.join()
        self.assertEqual(len(held), 204)
        out = rig.end()
        for connection in held:
            connection.close()
        self.assert_no_tick_is_missing(rig, out, [0.7281, 0.6])

    def test_a_wrong_token_opens_nothing(self):
        rig = Served(self.folder, "--token", TOKEN)
        own = "Content-Type: application/json"
        for path in ("/", "/api/model", "/api/live", "/api/recording", "/api/model?token=", "/api/model?token=" + TOKEN[:-1]):
            answer = rig.ask(rig.head("GET %s HTTP/1.1" % path))
            self.assertRegex(answer, r"(?s)^HTTP/1\.1 403 .*wrong or missing token")
        self.assertRegex(rig.post(own, "X-Shiftrig-Token: guess"), r"^HTTP/1\.1 403 ")
        self.assertRegex(rig.post(own, "X-Shiftrig-Token: " + TOKEN, "Origin: http://evil.example"), r"^HTTP/1\.1 403 ")
        self.assertRegex(rig.ask(rig.head("GET /api/model?token=%s HTTP/1.1" % TOKEN)), r"^HTTP/1\.1 200 ")
        self.assert_no_tick_is_missing(rig, rig.end(), [0.7281])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[3:]])
