"""Senders for others' programs, compiled and run where the machine can: their bytes are the controller's."""

from __future__ import annotations

import math
import shutil
import struct
import subprocess
import sys

import numpy as np
import pytest

from motion_cueing.realtime import Cues, FloatsFormat, SetPoint, State
from motion_cueing.realtime.server import Endpoint

from ..repository import ROOT

SENDERS = ROOT / "examples" / "senders"
FORM = FloatsFormat()
CASES = [
    Cues(0, 0.0, (0.0, 0.0, -9.81), (0.0, 0.0, 0.0)),
    Cues(2**64 - 2, 1e9 + 1.0 / 3.0, (1.5, -2.25, -9.0), (0.1, -0.2, 0.3)),
    Cues(7, -1.0, (math.pi, -0.0, 1e-300), (1e300, 5e-324, -math.e), True),
]
SETPOINT = SetPoint(State.HOLDING, 2**40 + 3, 2**64 - 1, 1.25, 2.5, 3.75, np.arange(39) * 0.1 - 1.0)

C_PROGRAM = r"""
#include "motion_cueing.h"
#include <stdio.h>
#include <stdlib.h>

/* pack SEQUENCE TIME F F F W W W PAUSED | unpack (from stdin) | talk PORT */
int main(int argc, char **argv)
{
    uint8_t packet[MCG_CUES_SIZE];
    double v[7];
    mcg_setpoint s;
    if (argc > 2 && strcmp(argv[1], "pack") == 0) {
        for (int k = 0; k < 7; ++k)
            v[k] = strtod(argv[3 + k], NULL);
        mcg_pack(packet, strtoull(argv[2], NULL, 10), v[0], v + 1, v + 4, atoi(argv[10]));
        fwrite(packet, 1, sizeof packet, stdout);
        return 0;
    }
    if (argc > 2 && strcmp(argv[1], "talk") == 0) {
        const double force[3] = {0.5, 0.0, -9.81}, rate[3] = {0.0, 0.0, 0.1};
        mcg_sender sender;
        if (mcg_open(&sender, "127.0.0.1", argv[2]) != 0)
            return 2;
        for (int k = 0; k < 3; ++k)
            if (mcg_send(&sender, 0.01 * k, force, rate, k == 2) != 0)
                return 3;
        fflush(stdout);
        if (getchar() == EOF || mcg_receive(&sender, &s) != 0)
            return 4;
        mcg_close(&sender);
    } else {
        uint8_t data[1000];
        if (mcg_unpack(data, fread(data, 1, sizeof data, stdin), &s) != 0)
            return 1;
    }
    printf("%d %llu %llu %.17g %.17g %.17g", s.state, (unsigned long long)s.sequence,
           (unsigned long long)s.echo, s.echo_time, s.received, s.sent);
    for (int k = 0; k < 9; ++k) printf(" %.17g", s.position[k]);
    for (int k = 0; k < 9; ++k) printf(" %.17g", s.velocity[k]);
    for (int k = 0; k < 9; ++k) printf(" %.17g", s.acceleration[k]);
    for (int k = 0; k < 6; ++k) printf(" %.17g", s.legs[k]);
    for (int k = 0; k < 6; ++k) printf(" %.17g", s.leg_rates[k]);
    return 0;
}
"""

PYTHON_PROGRAM = r"""
import sys
sys.path.insert(0, sys.argv[1])
import motion_cueing_sender as m
kind, words = sys.argv[2], sys.argv[3:]
if kind == "pack":
    v = [float(word) for word in words[1:8]]
    sys.stdout.buffer.write(m.pack(int(words[0]), v[0], v[1:4], v[4:7], words[8] == "1"))
    sys.exit()
if kind == "talk":
    with m.Sender("127.0.0.1", int(words[0])) as sender:
        for k in range(3):
            assert sender.send(0.01 * k, (0.5, 0.0, -9.81), (0.0, 0.0, 0.1), k == 2)
        sys.stdin.read(1)
        (s,) = sender.receive()
else:
    s = m.unpack(sys.stdin.buffer.read())
    if s is None:
        sys.exit(1)
print(*s[:6], *s.position, *s.velocity, *s.acceleration, *s.legs, *s.leg_rates)
"""

CSHARP_PROGRAM = r"""
using System;
using System.Globalization;
using System.IO;
using System.Linq;
using MotionCueing;

public static class Program
{
    public static int Main(string[] words)
    {
        CultureInfo.CurrentCulture = CultureInfo.InvariantCulture;
        SetPoint s;
        if (words[0] == "pack")
        {
            var v = words.Skip(2).Take(7).Select(double.Parse).ToArray();
            var data = Packet.Pack(ulong.Parse(words[1]), v[0], v.Skip(1).Take(3).ToArray(),
                                   v.Skip(4).ToArray(), words[9] == "1");
            using (var output = Console.OpenStandardOutput()) output.Write(data, 0, data.Length);
            return 0;
        }
        if (words[0] == "talk")
        {
            using (var sender = new Sender("127.0.0.1", int.Parse(words[1])))
            {
                for (int k = 0; k < 3; ++k)
                    sender.Send(0.01 * k, new[] {0.5, 0.0, -9.81}, new[] {0.0, 0.0, 0.1}, k == 2);
                Console.Read();
                if (!sender.TryReceive(out s)) return 4;
            }
        }
        else
        {
            var input = new MemoryStream();
            Console.OpenStandardInput().CopyTo(input);
            if (!Packet.TryUnpack(input.ToArray(), out s)) return 1;
        }
        var numbers = new[] {s.EchoTime, s.Received, s.Sent}.Concat(s.Position).Concat(s.Velocity)
            .Concat(s.Acceleration).Concat(s.Legs).Concat(s.LegRates).Select(x => x.ToString("R"));
        Console.Write((int)s.State + " " + s.Sequence + " " + s.Echo + " " + string.Join(" ", numbers));
        return 0;
    }
}
"""


def compiled_c(folder, compiler, *flags):
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler} on this machine: the C header is not compiled")
    suffix = ".cpp" if "+" in compiler else ".c"
    program = folder / f"program{suffix}"
    program.write_text(C_PROGRAM)
    words = [compiler, *flags, "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
    subprocess.run([*words, "-I", str(SENDERS), str(program), "-o", str(folder / "program")], check=True)
    return [str(folder / "program")]


def compiled_csharp(folder):
    program = folder / "Program.cs"
    program.write_text(CSHARP_PROGRAM)
    sources = [str(SENDERS / "MotionCueing.cs"), str(program)]
    for compiler in ("mcs", "csc"):
        if shutil.which(compiler) and shutil.which("mono"):
            out = folder / "program.exe"
            subprocess.run([compiler, f"-out:{out}", "-warnaserror", *sources], check=True)
            return ["mono", str(out)]
    if shutil.which("dotnet"):
        project = folder / "program.csproj"
        includes = "".join(f'<Compile Include="{source}" />' for source in sources[:1])
        project.write_text(
            '<Project Sdk="Microsoft.NET.Sdk"><PropertyGroup><OutputType>Exe</OutputType>'
            "<TargetFramework>net8.0</TargetFramework><RollForward>Major</RollForward></PropertyGroup>"
            f"<ItemGroup>{includes}</ItemGroup></Project>"
        )
        subprocess.run(["dotnet", "build", str(project), "-o", str(folder / "out")], check=True)
        return ["dotnet", str(folder / "out" / "program.dll")]
    pytest.skip("neither mcs, csc nor dotnet on this machine: the C# sender is not compiled")
    return []


@pytest.fixture(scope="module", params=["c99", "c++", "python", "c#"])
def program(request, tmp_path_factory):
    """Words that run a program with one of the senders."""
    folder = tmp_path_factory.mktemp("sender")
    if request.param == "c99":
        return compiled_c(folder, "gcc", "-std=c99")
    if request.param == "c++":
        return compiled_c(folder, "g++", "-std=c++11")
    if request.param == "python":
        # Isolated: the standard library is all there is.
        return [sys.executable, "-I", "-S", "-c", PYTHON_PROGRAM, str(SENDERS)]
    return compiled_csharp(folder)


def numbers_of(output: bytes) -> list[float]:
    return [float(word) for word in output.split()]


def assert_the_setpoint(output: bytes) -> None:
    words = output.split()
    assert [int(word) for word in words[:3]] == [SETPOINT.state, SETPOINT.sequence, SETPOINT.echo]
    assert numbers_of(output)[3:6] == [1.25, 2.5, 3.75]
    np.testing.assert_array_equal(numbers_of(output)[6:], SETPOINT.motion)


@pytest.mark.parametrize("cues", CASES, ids=["standing", "moving", "paused"])
def test_packets_are_the_controllers_to_the_bit(program, cues):
    numbers = [repr(float(value)) for value in (cues.time, *cues.force, *cues.rate)]
    words = [*program, "pack", str(cues.sequence), *numbers, str(int(cues.paused))]
    packet = subprocess.run(words, check=True, capture_output=True).stdout
    assert packet == FORM.pack_cues(cues)


def test_set_points_are_read(program):
    data = FORM.pack_setpoint(SETPOINT)
    assert_the_setpoint(
        subprocess.run([*program, "unpack"], input=data, check=True, capture_output=True).stdout
    )


def test_damaged_set_points_are_refused(program):
    data = FORM.pack_setpoint(SETPOINT)
    other = bytearray(data)
    struct.pack_into("<H", other, 4, 2)
    for wrong in (data[:-1], data + b"\0", bytes([data[0] ^ 1]) + data[1:], data[:100] + b"?" + data[101:],
                  bytes(other)):  # fmt: skip
        assert subprocess.run([*program, "unpack"], input=wrong, capture_output=True).returncode == 1


def test_a_controller_is_talked_to(program):
    controller, packets = Endpoint(("127.0.0.1", 0)), []
    words = [*program, "talk", str(controller.address[1])]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        for _ in range(600):
            controller.listen(0, lambda data, sender, now: packets.append((data, sender)))
            if len(packets) == 3:
                break
            try:
                process.wait(0.05)
            except subprocess.TimeoutExpired:
                continue
        controller.send(b"noise", packets[0][1])
        controller.send(FORM.pack_setpoint(SETPOINT), packets[0][1])
        output, _ = process.communicate(b"\n")
    controller.close()
    assert process.returncode == 0
    received = [FORM.unpack_cues(data) for data, _ in packets]
    assert [(cues.sequence, cues.paused) for cues in received] == [(0, False), (1, False), (2, True)]
    assert received[1].force == (0.5, 0.0, -9.81)
    assert received[1].rate == (0.0, 0.0, 0.1)
    assert_the_setpoint(output)
