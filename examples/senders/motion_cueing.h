/* Sender of cues to `motion-cueing serve`, in one header. C99 or C++, no allocation, no dependency.
 *
 * Axes of the car: x forward, y to the right, z down. SI units, radians. The specific force is
 * f = a - g: a car that stands has {0, 0, -9.81}. Send a packet for each step of your simulation, at
 * 100 Hz or more. While your simulation is paused, go on sending with paused = 1.
 *
 *     mcg_sender sender;
 *     if (mcg_open(&sender, "127.0.0.1", "47100") != 0) return 1;
 *     mcg_send(&sender, seconds, force, rate, 0);
 *     mcg_setpoint setpoint;
 *     while (mcg_receive(&sender, &setpoint) == 0) { ... }
 *     mcg_close(&sender);
 *
 * Include it before other headers, or define _POSIX_C_SOURCE as 200112L. On Windows, link Ws2_32.lib and
 * call WSAStartup first. With MCG_NO_SOCKETS there are mcg_pack and mcg_unpack alone.
 * The layout of the packets: docs/reference/real-time.md.
 */
#ifndef MOTION_CUEING_H
#define MOTION_CUEING_H

#if !defined(_WIN32) && !defined(_POSIX_C_SOURCE)
#define _POSIX_C_SOURCE 200112L
#endif

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define MCG_CUES_SIZE 76
#define MCG_SETPOINT_SIZE 364

/* State of the controller's watchdog. */
enum { MCG_NEUTRAL = 0, MCG_RUNNING = 1, MCG_HOLDING = 2, MCG_BRAKING = 3 };

/* Set-point of the machine, from neutral, m and rad. Axes: carriage x, y; surge, sway, heave, roll, pitch,
 * yaw of the hexapod; turntable. */
typedef struct {
    int state;             /* MCG_NEUTRAL to MCG_BRAKING */
    uint64_t sequence;     /* one more for each set-point */
    uint64_t echo;         /* sequence of the cues that last moved the machine; 2^64 - 1 before any */
    double echo_time;      /* their time, s of the sender's clock */
    double received;       /* when they arrived, s of the controller's clock */
    double sent;           /* when this was made, s of the controller's clock */
    double position[9];
    double velocity[9];
    double acceleration[9];
    double legs[6];        /* extensions, m */
    double leg_rates[6];   /* m/s */
} mcg_setpoint;

static inline uint32_t mcg_crc32(const uint8_t *data, size_t size)
{
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t k = 0; k < size; ++k) {
        crc ^= data[k];
        for (int bit = 0; bit < 8; ++bit)
            crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u)));
    }
    return ~crc;
}

static inline void mcg_put(uint8_t *out, uint64_t value, int bytes)
{
    for (int k = 0; k < bytes; ++k)
        out[k] = (uint8_t)(value >> (8 * k));
}

static inline uint64_t mcg_get(const uint8_t *data, int bytes)
{
    uint64_t value = 0;
    for (int k = 0; k < bytes; ++k)
        value |= (uint64_t)data[k] << (8 * k);
    return value;
}

static inline void mcg_put_double(uint8_t *out, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    mcg_put(out, bits, 8);
}

static inline double mcg_get_double(const uint8_t *data)
{
    uint64_t bits = mcg_get(data, 8);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* The packet of cues: time in s of your clock, force in m/s^2, rate in rad/s. */
static inline void mcg_pack(uint8_t out[MCG_CUES_SIZE], uint64_t sequence, double time, const double force[3],
                            const double rate[3], int paused)
{
    memcpy(out, "MCGC", 4);
    mcg_put(out + 4, paused ? 2u : 1u, 2);
    mcg_put(out + 6, paused ? 1u : 0u, 2);
    mcg_put(out + 8, sequence, 8);
    mcg_put_double(out + 16, time);
    for (int k = 0; k < 3; ++k) {
        mcg_put_double(out + 24 + 8 * k, force[k]);
        mcg_put_double(out + 48 + 8 * k, rate[k]);
    }
    mcg_put(out + 72, mcg_crc32(out, 72), 4);
}

/* Read a set-point; 0 if it is one, -1 if size, mark, version or checksum are wrong. */
static inline int mcg_unpack(const uint8_t *data, size_t size, mcg_setpoint *setpoint)
{
    if (size != MCG_SETPOINT_SIZE || memcmp(data, "MCGS", 4) != 0 || mcg_get(data + 4, 2) != 1 || data[6] > 3)
        return -1;
    if (mcg_crc32(data, MCG_SETPOINT_SIZE - 4) != mcg_get(data + MCG_SETPOINT_SIZE - 4, 4))
        return -1;
    setpoint->state = data[6];
    setpoint->sequence = mcg_get(data + 8, 8);
    setpoint->echo = mcg_get(data + 16, 8);
    setpoint->echo_time = mcg_get_double(data + 24);
    setpoint->received = mcg_get_double(data + 32);
    setpoint->sent = mcg_get_double(data + 40);
    for (int k = 0; k < 9; ++k) {
        setpoint->position[k] = mcg_get_double(data + 48 + 8 * k);
        setpoint->velocity[k] = mcg_get_double(data + 120 + 8 * k);
        setpoint->acceleration[k] = mcg_get_double(data + 192 + 8 * k);
    }
    for (int k = 0; k < 6; ++k) {
        setpoint->legs[k] = mcg_get_double(data + 264 + 8 * k);
        setpoint->leg_rates[k] = mcg_get_double(data + 312 + 8 * k);
    }
    return 0;
}

#ifndef MCG_NO_SOCKETS

#ifdef _WIN32
#include <winsock2.h>
#include <ws2tcpip.h>
typedef SOCKET mcg_socket;
#else
#include <netdb.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>
typedef int mcg_socket;
#endif

typedef struct {
    mcg_socket socket;
    uint64_t sequence;
} mcg_sender;

/* Connect to a controller by host and port; 0, or -1 if there is no such host. */
static inline int mcg_open(mcg_sender *sender, const char *host, const char *port)
{
    struct addrinfo hints, *found = NULL;
    memset(&hints, 0, sizeof hints);
    hints.ai_family = AF_INET;
    hints.ai_socktype = SOCK_DGRAM;
    if (getaddrinfo(host, port, &hints, &found) != 0)
        return -1;
    sender->sequence = 0;
    sender->socket = socket(found->ai_family, found->ai_socktype, found->ai_protocol);
#ifdef _WIN32
    int failed = sender->socket == INVALID_SOCKET;
    failed = failed || connect(sender->socket, found->ai_addr, (int)found->ai_addrlen) != 0;
#else
    int failed = sender->socket < 0;
    failed = failed || connect(sender->socket, found->ai_addr, found->ai_addrlen) != 0;
#endif
    freeaddrinfo(found);
    return failed ? -1 : 0;
}

/* Send cues; 0, or -1 if the network refuses them: they are lost, and the next may pass. */
static inline int mcg_send(mcg_sender *sender, double time, const double force[3], const double rate[3],
                           int paused)
{
    uint8_t packet[MCG_CUES_SIZE];
    mcg_pack(packet, sender->sequence, time, force, rate, paused);
    sender->sequence += 1;
#ifdef _WIN32
    return send(sender->socket, (const char *)packet, MCG_CUES_SIZE, 0) == MCG_CUES_SIZE ? 0 : -1;
#else
    return send(sender->socket, packet, MCG_CUES_SIZE, 0) == MCG_CUES_SIZE ? 0 : -1;
#endif
}

/* The next set-point that has arrived; 0, or -1 if there is none. Does not wait. */
static inline int mcg_receive(mcg_sender *sender, mcg_setpoint *setpoint)
{
    uint8_t data[MCG_SETPOINT_SIZE + 1];
    for (;;) {
        fd_set ready;
        struct timeval at_once = {0, 0};
        FD_ZERO(&ready);
        FD_SET(sender->socket, &ready);
        if (select((int)sender->socket + 1, &ready, NULL, NULL, &at_once) <= 0)
            return -1;
#ifdef _WIN32
        int size = recv(sender->socket, (char *)data, sizeof data, 0);
#else
        ssize_t size = recv(sender->socket, data, sizeof data, 0);
#endif
        if (size < 0)
            return -1;
        if (mcg_unpack(data, (size_t)size, setpoint) == 0)
            return 0;
    }
}

static inline void mcg_close(mcg_sender *sender)
{
#ifdef _WIN32
    closesocket(sender->socket);
#else
    close(sender->socket);
#endif
}

#endif /* MCG_NO_SOCKETS */
#endif /* MOTION_CUEING_H */
