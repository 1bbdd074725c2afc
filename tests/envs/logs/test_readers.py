"""Every format, written by its own library from one known drive, comes back as that drive."""

from __future__ import annotations

import builtins
import gzip
import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from motion_cueing.cli.main import main
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.logs.importer import ImportedLog, import_log, select_columns
from motion_cueing.envs.logs.readers import read_recording
from motion_cueing.envs.logs.signals import ImportOptions

from .synthetic_log import Floats, Truth, drive

START_NS = 1_714_866_590 * 10**9
"""2024-05-04T23:49:50Z."""
TRUTH = drive(30.0, 25.0)
RECEIVED = slice(None, None, 5)
"""A receiver has one row in five."""


def clock_time(seconds: float, separator: str = "") -> str:
    """HHMMSS.SS of so many seconds after 9:58:50."""
    whole = 9 * 3600 + 58 * 60 + 50 + seconds
    hours, rest = divmod(round(whole, 3), 3600)
    return separator.join((f"{int(hours):02d}", f"{int(rest // 60):02d}", f"{rest % 60:06.3f}"))


def assert_the_drive(result: ImportedLog, truth: Truth = TRUTH, force: float = 0.06) -> None:
    n = min(len(result.trace), 2901)
    time = np.arange(n) / 100
    inside = slice(150, n - 150)
    for found, wanted, bar in (
        (result.trace.specific_force, truth.force, force),
        (result.trace.angular_velocity[:, 2:], truth.rate[:, 2:], 0.01),
    ):
        for axis, column in enumerate(wanted.T):
            difference = found[:n, axis] - np.interp(time, truth.time, column)
            assert np.sqrt(np.mean(difference[inside] ** 2)) < bar
    assert result.trace.duration > 28.9


def table(**others: Floats) -> dict[str, Floats]:
    force, rate = TRUTH.force.T, TRUTH.rate.T
    columns = {"time": TRUTH.time, **dict(zip(("ax", "ay", "az"), force, strict=True))}
    columns |= dict(zip(("wx", "wy", "wz"), rate, strict=True))
    return columns | {"speed": TRUTH.speed, "course": np.degrees(TRUTH.course) % 360.0} | others


def text(columns: dict[str, Floats], separator: str = ",", decimal: str = ".", quote: str = "") -> str:
    lines = [separator.join(columns)]
    for row in zip(*columns.values(), strict=True):
        cells = ("" if np.isnan(one) else f"{one:.9g}".replace(".", decimal) for one in row)
        lines.append(separator.join(f"{quote}{cell}{quote}" for cell in cells))
    return "\n".join(lines) + "\n"


def european() -> bytes:
    units = ["s", "m/s²", "m/s²", "m/s²", "°/s", "°/s", "°/s", "km/h", "°"]
    head, body = text(
        table(
            wx=np.degrees(TRUTH.rate[:, 0]),
            wy=np.degrees(TRUTH.rate[:, 1]),
            wz=np.degrees(TRUTH.rate[:, 2]),
            speed=3.6 * TRUTH.speed,
        ),
        ";",
        ",",
    ).split("\n", 1)
    return "\n".join(["Logger 7", "Session: test", "", head, ";".join(units), body]).encode("latin-1")


def with_clock(stamp: Callable[[float], str]) -> bytes:
    columns = table()
    columns.pop("time")
    lines = text(columns).splitlines()
    stamps = ["time", *map(stamp, TRUTH.time.tolist())]
    return "\n".join(f"{a},{b}" for a, b in zip(stamps, lines, strict=True)).encode()


def iso(seconds: float) -> str:
    return str(np.datetime64(START_NS, "ns") + np.timedelta64(round(1e3 * seconds), "ms")) + "Z"


def thousands() -> bytes:
    """Milliseconds with a mark at each thousand, as a spreadsheet shows them."""
    columns = table()
    rows = [";".join(columns)]
    for row in zip(*columns.values(), strict=True):
        stamp = f"{86_000_000 + 1000 * row[0]:,.0f}".replace(",", ".")
        rows.append(";".join([stamp, *(f"{one:.6f}".replace(".", ",") for one in row[1:])]))
    return "\n".join(rows).encode()


def in_brackets() -> bytes:
    names = ["Time (ms)", "Acceleration x [g]", "Acceleration y [g]", "Acceleration z [g]"]
    names += ["Gyro x (deg/s)", "Gyro y (deg/s)", "Gyro z (deg/s)", "GPS Speed (kn)", "Heading (deg)"]
    scale = [1e3, *[1.0 / 9.80665] * 3, *[np.degrees(1.0)] * 3, 3600.0 / 1852.0, 1.0]
    columns = [factor * one for factor, one in zip(scale, table().values(), strict=True)]
    return text(dict(zip(names, columns, strict=True)), "\t").encode("utf-16")


DIALECTS: dict[str, tuple[Callable[[], bytes], str]] = {
    "semicolon, decimal comma, units, preamble, Latin-1": (european, "decimal comma, latin-1, 2 lines"),
    "ISO time over midnight": (lambda: with_clock(iso), "utf-8"),
    "HHMMSS.SS": (lambda: with_clock(clock_time), "utf-8"),
    "HH:MM:SS.SS": (lambda: with_clock(lambda t: clock_time(t, ":")), "utf-8"),
    "marks at each thousand": (thousands, "separator ';', decimal comma"),
    "tab, brackets, UTF-16": (in_brackets, "separator tab, decimal point, utf-16"),
    "spaces": (lambda: text(table(), "  ").encode(), "separator spaces"),
    "byte-order mark and quotes": (lambda: b"\xef\xbb\xbf" + text(table(), quote='"').encode(), "utf-8-sig"),
    "pipe, packed": (lambda: gzip.compress(text(table(), "|").encode()), "separator '|'"),
}


@pytest.mark.parametrize("kind", DIALECTS)
def test_dialects_of_csv(tmp_path: Path, kind: str) -> None:
    content, said = DIALECTS[kind]
    path = tmp_path / ("log.csv.gz" if "packed" in kind else "log.csv")
    path.write_bytes(content())
    result = import_log(path)
    assert said in result.findings.format
    assert_the_drive(result)


def write_vbo(path: Path) -> None:
    names = "sats time lat long velocity heading long-accel lat-accel yaw-rate"
    lines = ["File created", "", "[header]", *names.split(), "", "[column names]", names, "", "[data]"]
    columns = table()
    for place, seconds in enumerate(TRUTH.time.tolist()):
        # Times before ten o'clock may come without their leading zero.
        row = [7, clock_time(seconds).lstrip("0"), "+03120.000000", "+00060.000000"]
        row += [f"{3.6 * columns['speed'][place]:.3f}", f"{columns['course'][place]:.2f}"]
        row += [f"{columns[name][place] / 9.80665:+.5f}" for name in ("ax", "ay")]
        row += [f"{np.degrees(columns['wz'][place]):+.4f}"]
        lines.append(" ".join(map(str, row)))
    path.write_text("\n".join(lines))


def write_mdf(path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")

    def group(names: dict[str, tuple[Floats, str]], stamps: Floats) -> list[object]:
        return [
            asammdf.Signal(values, timestamps=stamps, name=name, unit=unit)
            for name, (values, unit) in names.items()
        ]

    with asammdf.MDF(version="4.10") as measurement:
        inertial = {
            f"Acceleration{'XYZ'[axis]}": (one / 9.80665, "g") for axis, one in enumerate(TRUTH.force.T)
        }
        rates = {f"Gyro{'XYZ'[axis]}": (np.degrees(one), "°/s") for axis, one in enumerate(TRUTH.rate.T)}
        measurement.append(group(inertial, TRUTH.time), acq_name="acceleration")
        measurement.append(group(rates, TRUTH.time + 0.003), acq_name="gyro")
        slow = {
            "VehicleSpeed": (3.6 * TRUTH.speed[RECEIVED], "km/h"),
            "Heading": (np.degrees(TRUTH.course[RECEIVED]) % 360.0, "deg"),
        }
        measurement.append(group(slow, TRUTH.time[RECEIVED]), acq_name="receiver")
        measurement.append(
            group({"Gear": (np.arange(31, dtype=np.uint8) % 5, "")}, np.arange(31.0)), acq_name="gearbox"
        )
        measurement.save(path, overwrite=True)


def write_sensor_logger(path: Path) -> None:
    stamps = START_NS + np.round(1e9 * TRUTH.time).astype(np.int64)

    def rows(names: str, columns: list[Floats], kept: slice = slice(None)) -> str:
        lines = [f"time,seconds_elapsed,{names}"]
        for stamp, seconds, row in zip(
            stamps[kept], TRUTH.time[kept], np.column_stack(columns)[kept], strict=True
        ):
            lines.append(f"{stamp},{seconds:.4f}," + ",".join(f"{one:.8g}" for one in row))
        return "\n".join(lines) + "\n"

    rest = np.zeros_like(TRUTH.force) - [0.0, 0.0, 9.81]
    own = TRUTH.force - rest
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("Accelerometer.csv", rows("z,y,x", list(own.T[::-1])))
        archive.writestr("Gravity.csv", rows("z,y,x", list(rest.T[::-1])))
        archive.writestr("Gyroscope.csv", rows("z,y,x", list(TRUTH.rate.T[::-1])))
        course = np.degrees(TRUTH.course) % 360.0
        archive.writestr("Location.csv", rows("bearing,speed", [course, TRUTH.speed], RECEIVED))
        archive.writestr("Metadata.csv", "version,device\n3,phone\n")
        archive.writestr("Annotation.csv", "time,seconds_elapsed,text\n")


def write_phyphox(path: Path) -> None:
    def rows(names: list[str], columns: list[Floats], kept: slice = slice(None)) -> str:
        values = np.column_stack([TRUTH.time, *columns])[kept]
        head = ";".join(f'"{name}"' for name in ["Time (s)", *names])
        lines = [";".join(f"{one:.9E}".replace(".", ",") for one in row) for row in values]
        return "\n".join([head, *lines]) + "\n"

    with zipfile.ZipFile(path, "w") as archive:
        names = [f"Acceleration {axis} (m/s^2)" for axis in "xyz"]
        archive.writestr("Accelerometer.csv", rows(names, list(TRUTH.force.T)))
        names = [f"Gyroscope {axis} (rad/s)" for axis in "xyz"]
        archive.writestr("Gyroscope.csv", rows(names, list(TRUTH.rate.T)))
        names = ["Latitude (°)", "Longitude (°)", "Velocity (m/s)", "Direction (°)"]
        course = np.degrees(TRUTH.course) % 360.0
        columns = [TRUTH.time, TRUTH.time, TRUTH.speed, course]
        archive.writestr("Location.csv", rows(names, columns, RECEIVED))
        archive.writestr("meta/device.csv", '"property";"value"\n"version";"1"\n')


def _stamp(place: int) -> tuple[int, int]:
    return divmod(START_NS + round(1e9 * TRUTH.time[place]), 10**9)


def _velocity(place: int) -> tuple[float, float]:
    """East and north, m/s."""
    course = TRUTH.course[place]
    return TRUTH.speed[place] * np.sin(course), TRUTH.speed[place] * np.cos(course)


def ros_messages(store) -> list[tuple[str, int, object]]:
    """Topic, time of receipt and message; the axes are forward, left and up."""
    imu, twist = store.types["sensor_msgs/msg/Imu"], store.types["geometry_msgs/msg/TwistStamped"]
    vector = store.types["geometry_msgs/msg/Vector3"]
    head, time = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    turned = store.types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
    none, flip = np.zeros(9), np.array([1.0, -1.0, -1.0])
    found: list[tuple[str, int, object]] = []
    for place in range(len(TRUTH.time)):
        header = head(stamp=time(*_stamp(place)), frame_id="imu")
        force, rate = flip * TRUTH.force[place], flip * TRUTH.rate[place]
        message = imu(header, turned, none, vector(*rate), none, vector(*force), none)
        # Messages are received late, and not in their order.
        late = START_NS + round(1e9 * TRUTH.time[place]) + 5_000_000 + 60_000_000 * (place % 2)
        found.append(("/imu/data", late, message))
        if place % 5 == 0:
            east, north = _velocity(place)
            speed = store.types["geometry_msgs/msg/Twist"](vector(east, north, 0.0), vector(0.0, 0.0, 0.0))
            found.append(("/gps/vel", late, twist(header, speed)))
    return sorted(found, key=lambda one: one[1])


def write_rosbag2(path: Path) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with rosbag2.Writer(path, version=8) as writer:
        connections = {
            "/imu/data": writer.add_connection("/imu/data", "sensor_msgs/msg/Imu", typestore=store),
            "/gps/vel": writer.add_connection("/gps/vel", "geometry_msgs/msg/TwistStamped", typestore=store),
        }
        for topic, received, message in ros_messages(store):
            connection = connections[topic]
            writer.write(connection, received, store.serialize_cdr(message, connection.msgtype))


def write_mcap_of_ros(path: Path) -> None:
    writer_module = pytest.importorskip("mcap.writer")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    kinds = {"/imu/data": "sensor_msgs/msg/Imu", "/gps/vel": "geometry_msgs/msg/TwistStamped"}
    with path.open("wb") as file:
        writer = writer_module.Writer(file)
        writer.start("ros2")
        channels = {}
        for topic, kind in kinds.items():
            definition, _ = store.generate_msgdef(kind)
            schema = writer.register_schema(kind, "ros2msg", definition.encode())
            channels[topic] = writer.register_channel(topic, "cdr", schema)
        for topic, received, message in ros_messages(store):
            data = bytes(store.serialize_cdr(message, kinds[topic]))
            writer.add_message(channels[topic], received, data, received)
        writer.finish()


def write_mcap_of_json(path: Path) -> None:
    writer_module = pytest.importorskip("mcap.writer")
    with path.open("wb") as file:
        writer = writer_module.Writer(file)
        writer.start()
        schema = writer.register_schema("Imu", "jsonschema", b"{}")
        channel = writer.register_channel("/car", "json", schema)
        columns = table()
        for place, seconds in enumerate(TRUTH.time.tolist()):
            stamp = START_NS + round(1e9 * seconds)
            message = {name: float(one[place]) for name, one in columns.items() if name != "time"}
            writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)
        writer.finish()


FORMATS: dict[str, tuple[str, Callable[[Path], None], str]] = {
    "vbo": ("log.vbo", write_vbo, "RaceLogic VBO"),
    "mdf": ("log.mf4", write_mdf, "ASAM MDF 4.10, 4 channel groups"),
    "mcap of ROS 2": ("log.mcap", write_mcap_of_ros, "MCAP, 2 topics"),
    "mcap of JSON": ("log.mcap", write_mcap_of_json, "MCAP, 1 topics"),
    "bag of ROS 2": ("bag", write_rosbag2, "ROS bag, 2 topics"),
    "Sensor Logger": ("log.zip", write_sensor_logger, "Sensor Logger"),
    "Phyphox": ("log.zip", write_phyphox, "phone (Phyphox)"),
}


@pytest.mark.parametrize("kind", FORMATS)
def test_formats(tmp_path: Path, kind: str) -> None:
    name, make, said = FORMATS[kind]
    make(tmp_path / name)
    result = import_log(tmp_path / name)
    assert result.findings.format == said
    assert_the_drive(result)


@pytest.mark.parametrize(
    ("name", "head", "package"),
    [("log.mf4", b"MDF     4.10", "asammdf"), ("log.mcap", b"\x89MCAP0\r\n", "mcap"),
     ("log.bag", b"#ROSBAG V2.0\n", "rosbags")],
)  # fmt: skip
def test_a_missing_package_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, head: bytes, package: str
) -> None:
    real = builtins.__import__

    def without(wanted: str, *others: object) -> object:
        if wanted.split(".")[0] == package:
            raise ModuleNotFoundError(f"No module named {wanted!r}", name=wanted)
        return real(wanted, *others)  # type: ignore[arg-type]

    monkeypatch.setattr(builtins, "__import__", without)
    (tmp_path / name).write_bytes(head)
    with pytest.raises(DataError, match=rf"needs the package {package}.*motion-cueing-gym\[logs\]"):
        read_recording(tmp_path / name)


def test_a_dry_run_shows_the_proposal_and_writes_nothing(tmp_path: Path, capsys) -> None:
    (tmp_path / "log.csv").write_bytes(european())
    assert main(["import", str(tmp_path / "log.csv"), "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert (
        "format  CSV: separator ';', decimal comma, latin-1, 2 lines before the header, a row of units"
        in said
    )
    assert "speed=speed:km/h   unit from the file" in said
    words = said.splitlines()[-1].removeprefix("--columns ").split()
    assert words[0] == "time=time:s"
    assert len(words) == 9
    assert list(tmp_path.iterdir()) == [tmp_path / "log.csv"]
    assert main(["import", str(tmp_path / "log.csv")]) == 2
    assert "--out is missing" in capsys.readouterr().err


def test_columns_override_the_proposal(tmp_path: Path) -> None:
    columns = table() | {"fine": TRUTH.speed}
    (tmp_path / "log.csv").write_text(text(columns))
    recording = read_recording(tmp_path / "log.csv")
    options = ImportOptions()
    taken = select_columns(recording, {"speed": "fine", "course": "none"}, {"speed": "kph"}, options)
    assert taken.columns["speed"] == "fine"
    assert taken.units["speed"] == "km/h"
    assert "course" not in taken.columns
    assert taken.columns["force_x"] == "ax"
    names = ("time", "force_x", "force_y", "force_z", "rate_x", "rate_y", "rate_z")
    given = dict(zip(names, list(columns)[:7], strict=True))
    assert set(select_columns(recording, given, {}, options).columns) == set(names)


def test_a_log_without_a_gyro(tmp_path: Path) -> None:
    columns = {name: one for name, one in table().items() if name[0] != "w"}
    path = tmp_path / "log.csv"
    path.write_text(text(columns))
    with pytest.raises(ConfigurationError, match=r"no column for rate_x.*rates='from-course'"):
        import_log(path)
    for rates, said in (("from-course", "the rate of the course"), ("from-force", "f_y / v")):
        result = import_log(path, options=ImportOptions(rates=rates))
        assert said in result.findings.changes[0].text
        n = len(result.trace)
        speed, yaw_rate = (
            np.interp(np.arange(n) / 100, TRUTH.time, one) for one in (TRUTH.speed, TRUTH.rate.T[2])
        )
        # A slow car has no course, and no lateral force to divide.
        fast = (speed > 4.0) & (np.arange(n) > 100) & (np.arange(n) < n - 100)
        found = result.trace.angular_velocity
        assert np.sqrt(np.mean((found[fast, 2] - yaw_rate[fast]) ** 2)) < 0.02
        assert np.abs(found[:, :2]).max() < 0.02
        assert np.ptp(yaw_rate[fast]) > 0.3


def test_a_file_of_no_known_format(tmp_path: Path) -> None:
    for content, message in (
        (b"", "empty"),
        (b"\x00\x01\x02\n\x03\n", "zero bytes"),
        (b"a,b\nc,d\n", "no rows of"),
    ):
        (tmp_path / "log.csv").write_bytes(content)
        with pytest.raises(DataError, match=message):
            import_log(tmp_path / "log.csv")
    (tmp_path / "log.mf4").write_bytes(b"MDF     4.10" + bytes(200))
    pytest.importorskip("asammdf")
    with pytest.raises(DataError, match="cannot be read as MDF"):
        import_log(tmp_path / "log.mf4")
