"""Writes logs as machines do, with the writer of the vendor or field where its package has one, else by the published description of the file."""

from __future__ import annotations

import struct

#: Of a channel: times in seconds, values.
Columns = dict[str, tuple]


def ulog(path, columns: Columns) -> None:
    """ULog by its description in PX4's guide: a topic for each channel, with its stamps in microseconds."""
    with open(path, "wb") as file:

        def message(kind: bytes, body: bytes) -> None:
            file.write(struct.pack("<HB", len(body), kind[0]) + body)

        file.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0))
        for name in columns:
            message(b"F", f"{name}:uint64_t timestamp;float value;".encode())
        for k, name in enumerate(columns):
            message(b"A", struct.pack("<BH", 0, k) + name.encode())
        rows = [(t, k, v) for k, (times, values) in enumerate(columns.values()) for t, v in zip(times, values)]
        for t, k, v in sorted(rows):
            message(b"D", struct.pack("<HQf", k, round(1e6 * t), v))


def ardupilot(path, columns: Columns) -> None:
    """DataFlash log by the description in ArduPilot's documentation: a message for each channel."""
    with open(path, "wb") as file:

        def form(kind: int, length: int, name: str, fields: str, labels: str) -> None:
            head = struct.pack("<BBBBB", 0xA3, 0x95, 128, kind, length)
            file.write(head + name.encode().ljust(4, b"\0") + fields.encode().ljust(16, b"\0") + labels.encode().ljust(64, b"\0"))

        form(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
        for k, name in enumerate(columns):
            form(10 + k, 15, name, "Qf", "TimeUS,V")
        rows = [(t, k, v) for k, (times, values) in enumerate(columns.values()) for t, v in zip(times, values)]
        for t, k, v in sorted(rows):
            file.write(struct.pack("<BBBQf", 0xA3, 0x95, 10 + k, round(1e6 * t), v))


def betaflight(path, times, columns: dict, flights: int = 1) -> None:
    """Blackbox by its description in Betaflight's wiki: every field in each frame, as a variable-length integer."""

    def unsigned(value: int) -> bytes:
        found = b""
        while value > 127:
            found += bytes([value & 127 | 128])
            value >>= 7
        return found + bytes([value])

    def signed(value: int) -> bytes:
        return unsigned(2 * value if value >= 0 else -2 * value - 1)

    names = ["loopIteration", "time", *columns]
    numbers = lambda first, rest: ",".join(map(str, [first] * 2 + [rest] * len(columns)))
    with open(path, "wb") as file:
        for _ in range(flights):
            head = ["Product:Blackbox flight data recorder by Nicholas Sherlock", "Data version:2", "I interval:1", "P interval:1/1"]
            head += [f"Field I name:{','.join(names)}", f"Field I signed:{numbers(0, 1)}"]
            head += [f"Field I predictor:{numbers(0, 0)}", f"Field I encoding:{numbers(1, 0)}"]
            head += [f"Field P predictor:{numbers(0, 0)}", f"Field P encoding:{numbers(1, 0)}"]
            head += ["Field S name:flightModeFlags,stateFlags", "Field S signed:0,0", "Field S predictor:0,0", "Field S encoding:1,1"]
            file.write("".join(f"H {line}\n" for line in head).encode())
            for k, t in enumerate(times):
                row = b"".join(signed(int(values[k])) for values in columns.values())
                if k == 20:
                    file.write(b"S" + unsigned(3) + unsigned(1))
                file.write(b"I" + unsigned(k) + unsigned(round(1e6 * t)) + row)
            file.write(b"E\xffEnd of log\0")


def wpilog(path, columns: Columns) -> None:
    """WPILib's data log by its specification: a value is written when it changes."""
    with open(path, "wb") as file:

        def record(entry: int, stamp: int, body: bytes) -> None:
            # Lengths of entry, size and time: 4, 4 and 8 bytes.
            file.write(struct.pack("<BIIQ", 3 | 3 << 2 | 7 << 4, entry, len(body), stamp) + body)

        file.write(b"WPILOG" + struct.pack("<HI", 0x0100, 0))
        for k, name in enumerate(columns):
            texts = b"".join(struct.pack("<I", len(text)) + text.encode() for text in (name, "double", ""))
            record(0, 0, struct.pack("<BI", 0, k + 1) + texts)
        for k, (times, values) in enumerate(columns.values()):
            before = None
            for t, v in zip(times, values):
                if v != before:
                    record(k + 1, round(1e6 * t), struct.pack("<d", v))
                before = v


def mf4(path, columns: Columns) -> None:
    """asammdf's own writer: each channel in a group of its own, its sample 500 marked as invalid."""
    import numpy as np
    from asammdf import MDF, Signal

    with MDF(version="4.10") as log:
        for name, (times, values) in columns.items():
            invalid = np.zeros(len(values), dtype=bool)
            invalid[500] = True
            log.append([Signal(samples=values, timestamps=times, name=name, unit="V", invalidation_bits=invalid)])
        log.save(path, overwrite=True)


def tdms(path, columns: dict, dt: float) -> None:
    """npTDMS's own writer: waveforms of equal steps; each channel starts two steps after the one before."""
    import numpy as np
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(str(path)) as log:
        for k, (name, values) in enumerate(columns.items()):
            start = np.datetime64("2026-11-27T12:00:00.000000") + np.timedelta64(round(2e6 * k * dt), "us")
            properties = {"wf_increment": dt, "wf_start_offset": 0.0, "wf_start_time": start, "unit_string": "V"}
            log.write_segment([ChannelObject("rig", name, values, properties)])
