// Sender of cues to `motion-cueing serve`, in one file. C# 7.3 (also for Unity), no package.
//
// Axes of the car: x forward, y to the right, z down. SI units, radians. The specific force is f = a - g: a
// car that stands has {0, 0, -9.81}. Send a packet for each step of your simulation, at 100 Hz or more. While
// your simulation is paused, go on sending with paused = true.
//
//     using (var sender = new MotionCueing.Sender("127.0.0.1", 47100))
//     {
//         sender.Send(seconds, force, rate, false);
//         while (sender.TryReceive(out MotionCueing.SetPoint setPoint)) { ... }
//     }
//
// The layout of the packets: docs/reference/real-time.md.
using System;
using System.Net.Sockets;

namespace MotionCueing
{
    /// <summary>State of the controller's watchdog.</summary>
    public enum State { Neutral = 0, Running = 1, Holding = 2, Braking = 3 }

    /// <summary>Set-point of the machine, from neutral, m and rad. Axes: carriage x, y; surge, sway, heave,
    /// roll, pitch, yaw of the hexapod; turntable.</summary>
    public sealed class SetPoint
    {
        public State State;
        public ulong Sequence, Echo;
        public double EchoTime, Received, Sent;
        public double[] Position = new double[9], Velocity = new double[9], Acceleration = new double[9];
        public double[] Legs = new double[6], LegRates = new double[6];
    }

    /// <summary>Packets as bytes.</summary>
    public static class Packet
    {
        public const int CuesSize = 76, SetPointSize = 364;

        public static uint Crc32(byte[] data, int size)
        {
            uint crc = 0xFFFFFFFFu;
            for (int k = 0; k < size; ++k)
            {
                crc ^= data[k];
                for (int bit = 0; bit < 8; ++bit)
                    crc = (crc & 1u) != 0u ? (crc >> 1) ^ 0xEDB88320u : crc >> 1;
            }
            return ~crc;
        }

        private static void Put(byte[] data, int place, ulong value, int bytes)
        {
            for (int k = 0; k < bytes; ++k)
                data[place + k] = (byte)(value >> (8 * k));
        }

        private static ulong Get(byte[] data, int place, int bytes)
        {
            ulong value = 0;
            for (int k = 0; k < bytes; ++k)
                value |= (ulong)data[place + k] << (8 * k);
            return value;
        }

        private static double GetDouble(byte[] data, int place)
        {
            return BitConverter.Int64BitsToDouble((long)Get(data, place, 8));
        }

        private static void Fill(double[] values, byte[] data, int place)
        {
            for (int k = 0; k < values.Length; ++k)
                values[k] = GetDouble(data, place + 8 * k);
        }

        /// <summary>Cues: time in s of your clock, force in m/s^2, rate in rad/s.</summary>
        public static byte[] Pack(ulong sequence, double time, double[] force, double[] rate, bool paused)
        {
            var data = new byte[CuesSize];
            data[0] = (byte)'M'; data[1] = (byte)'C'; data[2] = (byte)'G'; data[3] = (byte)'C';
            Put(data, 4, paused ? 2u : 1u, 2);
            Put(data, 6, paused ? 1u : 0u, 2);
            Put(data, 8, sequence, 8);
            Put(data, 16, (ulong)BitConverter.DoubleToInt64Bits(time), 8);
            for (int k = 0; k < 3; ++k)
            {
                Put(data, 24 + 8 * k, (ulong)BitConverter.DoubleToInt64Bits(force[k]), 8);
                Put(data, 48 + 8 * k, (ulong)BitConverter.DoubleToInt64Bits(rate[k]), 8);
            }
            Put(data, 72, Crc32(data, 72), 4);
            return data;
        }

        /// <summary>Read a set-point; false if size, mark, version or checksum are wrong.</summary>
        public static bool TryUnpack(byte[] data, out SetPoint setPoint)
        {
            setPoint = null;
            if (data.Length != SetPointSize || data[0] != 'M' || data[1] != 'C' || data[2] != 'G'
                || data[3] != 'S' || Get(data, 4, 2) != 1 || data[6] > 3)
                return false;
            if (Crc32(data, SetPointSize - 4) != Get(data, SetPointSize - 4, 4))
                return false;
            setPoint = new SetPoint
            {
                State = (State)data[6],
                Sequence = Get(data, 8, 8),
                Echo = Get(data, 16, 8),
                EchoTime = GetDouble(data, 24),
                Received = GetDouble(data, 32),
                Sent = GetDouble(data, 40)
            };
            Fill(setPoint.Position, data, 48);
            Fill(setPoint.Velocity, data, 120);
            Fill(setPoint.Acceleration, data, 192);
            Fill(setPoint.Legs, data, 264);
            Fill(setPoint.LegRates, data, 312);
            return true;
        }
    }

    /// <summary>Sends cues, and receives set-points without waiting.</summary>
    public sealed class Sender : IDisposable
    {
        private readonly Socket _socket;
        private ulong _sequence;

        public Sender(string host, int port)
        {
            _socket = new Socket(AddressFamily.InterNetwork, SocketType.Dgram, ProtocolType.Udp);
            _socket.Connect(host, port);
        }

        /// <summary>Send cues; false if the network refuses them: they are lost, and the next may pass.</summary>
        public bool Send(double time, double[] force, double[] rate, bool paused)
        {
            try
            {
                return _socket.Send(Packet.Pack(_sequence++, time, force, rate, paused)) == Packet.CuesSize;
            }
            catch (SocketException)
            {
                return false;
            }
        }

        /// <summary>The next set-point that has arrived; false if there is none.</summary>
        public bool TryReceive(out SetPoint setPoint)
        {
            setPoint = null;
            var buffer = new byte[Packet.SetPointSize + 1];
            try
            {
                while (_socket.Available > 0)
                {
                    int size = _socket.Receive(buffer);
                    var data = new byte[size];
                    Array.Copy(buffer, data, size);
                    if (Packet.TryUnpack(data, out setPoint))
                        return true;
                }
            }
            catch (SocketException)
            {
                // Nobody listens there yet.
            }
            return false;
        }

        public void Dispose()
        {
            _socket.Dispose();
        }
    }
}
