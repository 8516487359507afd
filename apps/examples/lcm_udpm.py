"""LCM over UDP multicast in plain Python: no LCM runtime, no generated code.

    types = Types("lcmtypes")                      # the .lcm files themselves
    lcm = Udpm("239.255.76.67", 7667)
    channel, data = lcm.receive()
    if channel == "SHIFTRIG_SPEEDS": speeds = types["speeds_t"].decode(data)
    lcm.send("SHIFTRIG_CLUTCH_COMMAND", types["clutch_command_t"].encode({"seq": 0, ...}))

Fixed-size types of primitive fields only, which is what lcmtypes/ has. Messages up to 65499 bytes (one datagram).
"""
import glob
import math
import os
import re
import socket
import struct

CODES = {"int8_t": "b", "int16_t": "h", "int32_t": "i", "int64_t": "q", "byte": "B", "boolean": "?", "float": "f",
         "double": "d"}


class Type:
    """One struct: its layout (big-endian, in order) and the fingerprint that LCM puts before every message."""

    def __init__(self, text):
        text = re.sub(r"//[^\n]*", "", text)
        self.name, body = re.search(r"struct\s+(\w+)\s*\{(.*?)\}", text, re.S).groups()
        self.fields = []  # name, format, dimensions
        value = 0x12345678
        for kind, name, dimensions in re.findall(r"(\w+)\s+(\w+)((?:\[\d+\])*)\s*;", body):
            sizes = re.findall(r"\d+", dimensions)
            self.fields.append((name, CODES[kind], [int(size) for size in sizes]))
            value = self._string(self._string(value, name), kind)
            value = self._update(value, len(sizes))
            for size in sizes:
                value = self._string(self._update(value, 0), size)  # 0: a constant dimension
        value &= 0xFFFFFFFFFFFFFFFF
        self.fingerprint = struct.pack(">Q", (value << 1 | value >> 63) & 0xFFFFFFFFFFFFFFFF)
        self.layout = struct.Struct(">" + "".join("%d%s" % (math.prod(d), code) for _, code, d in self.fields))

    @staticmethod
    def _update(value, number):  # lcm-gen's hash, in 64-bit two's complement
        value = ((value << 8) ^ (value >> 55)) + number & 0xFFFFFFFFFFFFFFFF
        return value - (1 << 64) if value >> 63 else value

    def _string(self, value, text):
        value = self._update(value, len(text))
        for character in text:
            value = self._update(value, ord(character))
        return value

    def decode(self, data):
        """A dict of numbers, and lists for arrays (bytes for arrays of bytes); None if it is another type."""
        if data[:8] != self.fingerprint or len(data) != 8 + self.layout.size:
            return None
        values, message = iter(self.layout.unpack(data[8:])), {}
        for name, code, dimensions in self.fields:
            items = [next(values) for _ in range(math.prod(dimensions))]
            for size in dimensions[:0:-1]:
                items = [items[i:i + size] for i in range(0, len(items), size)]
            message[name] = items if dimensions else items[0]
        return message

    def encode(self, message):
        """Fields that are left out are 0."""
        flat = []
        for name, _, dimensions in self.fields:
            items = message.get(name, 0)
            count = math.prod(dimensions)
            items = list(items) if isinstance(items, (list, tuple, bytes)) else [items]
            flat += (items + [0] * count)[:count]
        return self.fingerprint + self.layout.pack(*flat)


class Types(dict):
    def __init__(self, folder):
        for path in glob.glob(os.path.join(folder, "*.lcm")):
            with open(path, encoding="utf-8") as file:
                kind = Type(file.read())
            self[kind.name] = kind


class Udpm:
    """One group. A message is a datagram: "LC02", a sequence number, the channel's name and a zero byte, the data."""

    def __init__(self, group="239.255.76.67", port=7667, ttl=0):
        self.address, self.sequence = (group, port), 0
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
        self.socket.bind(self.address)
        membership = socket.inet_aton(group) + socket.inet_aton("0.0.0.0")
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)

    def send(self, channel, data):
        self.socket.sendto(b"LC02" + struct.pack(">I", self.sequence) + channel.encode() + b"\0" + data, self.address)
        self.sequence = self.sequence + 1 & 0xFFFFFFFF

    def receive(self, timeout=None):
        """(channel, data); None after `timeout` seconds."""
        self.socket.settimeout(timeout)
        while True:
            try:
                datagram = self.socket.recv(65536)
            except socket.timeout:
                return None
            name, zero, data = datagram[8:].partition(b"\0")
            if datagram[:4] == b"LC02" and zero:
                return name.decode("utf-8", "replace"), data
