"""The C around an export that makes it an FMU: the functions of FMI 2.0 and of FMI 3.0.

The types of the standard are declared in the file itself, so that the sources of an FMU need no other header.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from ...envs.cues import GRAVITY
from .source import Source

_CORE: Final = r"""/* @ABOUT@, as an FMU for co-simulation, FMI @VERSION@.0. */
#include "@NAME@.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

static const char TOKEN[] = "@TOKEN@";

/* One instance. The outputs before the first step are those of a machine at rest. */
typedef struct {
    @NAME@_state state;
    @NAME@_input input;
    @NAME@_output output;
} model;

static void reset(model *m) {
    memset(m, 0, sizeof *m);
    @NAME@_init(&m->state);
@START@}

/* The variables by their value references, inputs first. */
static int get_value(const model *m, uint32_t reference, double *value) {
    switch (reference) {
@GET@        default:
            return 0;
    }
    return 1;
}

static int set_value(model *m, uint32_t reference, double value) {
    switch (reference) {
@SET@        default:
            return 0;
    }
    return 1;
}

/* Whole time steps, the inputs held; 0 where a step of the master holds no whole number of them. */
static int advance(model *m, double duration) {
    const double steps = duration / (double)@UPPER@_TIME_STEP;
    const double whole = floor(steps + 0.5);
    if (!(whole >= 1.0 && whole <= 1e6 && fabs(steps - whole) <= 1e-6 * whole)) {
        return 0;
    }
    for (int32_t k = 0; k < (int32_t)whole; k++) {
        @NAME@_step(&m->state, &m->input, &m->output);
    }
    return 1;
}
"""

_FMI2: Final = r"""
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef void (*fmi2Logger)(void *, const char *, fmi2Status, const char *, const char *, ...);
typedef struct {
    fmi2Logger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(void *, fmi2Status);
    void *componentEnvironment;
} fmi2CallbackFunctions;

/* An instance as the master holds it: the model, and what to call. */
typedef struct {
    model model;
    const fmi2CallbackFunctions *functions;
} instance;

EXPORT const char *fmi2GetTypesPlatform(void) {
    return "default";
}

EXPORT const char *fmi2GetVersion(void) {
    return "2.0";
}

EXPORT fmi2Status fmi2SetDebugLogging(void *c, int on, size_t n, const char *const categories[]) {
    (void)c, (void)on, (void)n, (void)categories;
    return fmi2OK;
}

EXPORT void *fmi2Instantiate(const char *name, int kind, const char *token, const char *resources,
        const fmi2CallbackFunctions *functions, int visible, int logging) {
    (void)name, (void)resources, (void)visible, (void)logging;
    if (functions == NULL || token == NULL || strcmp(token, TOKEN) != 0 || kind != 1) {
        return NULL;
    }
    instance *made = calloc(1, sizeof *made);
    if (made != NULL) {
        made->functions = functions;
        reset(&made->model);
    }
    return made;
}

EXPORT void fmi2FreeInstance(void *c) {
    free(c);
}

EXPORT fmi2Status fmi2SetupExperiment(void *c, int tolerance_defined, double tolerance, double start,
        int stop_defined, double stop) {
    (void)c, (void)tolerance_defined, (void)tolerance, (void)start, (void)stop_defined, (void)stop;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(void *c) {
    (void)c;
    return fmi2OK;
}

EXPORT fmi2Status fmi2ExitInitializationMode(void *c) {
    (void)c;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Terminate(void *c) {
    (void)c;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Reset(void *c) {
    reset(&((instance *)c)->model);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(void *c, const unsigned int references[], size_t n, double values[]) {
    for (size_t i = 0; i < n; i++) {
        if (!get_value(&((instance *)c)->model, references[i], &values[i])) {
            return fmi2Error;
        }
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(void *c, const unsigned int references[], size_t n, const double values[]) {
    for (size_t i = 0; i < n; i++) {
        if (!set_value(&((instance *)c)->model, references[i], values[i])) {
            return fmi2Error;
        }
    }
    return fmi2OK;
}

/* All variables are real numbers. */
#define NO_VARIABLES(NAME, TYPE)                                                                    \
    EXPORT fmi2Status NAME(void *c, const unsigned int references[], size_t n, TYPE values[]) {     \
        (void)c, (void)references, (void)values;                                                    \
        return n == 0 ? fmi2OK : fmi2Error;                                                         \
    }
NO_VARIABLES(fmi2GetInteger, int)
NO_VARIABLES(fmi2GetBoolean, int)
NO_VARIABLES(fmi2GetString, const char *)
NO_VARIABLES(fmi2SetInteger, const int)
NO_VARIABLES(fmi2SetBoolean, const int)
NO_VARIABLES(fmi2SetString, const char *const)

EXPORT fmi2Status fmi2GetFMUstate(void *c, void **state) {
    if (*state == NULL) {
        *state = malloc(sizeof(model));
    }
    if (*state == NULL) {
        return fmi2Error;
    }
    memcpy(*state, &((instance *)c)->model, sizeof(model));
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(void *c, void *state) {
    memcpy(&((instance *)c)->model, state, sizeof(model));
    return fmi2OK;
}

EXPORT fmi2Status fmi2FreeFMUstate(void *c, void **state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(void *c, void *state, size_t *size) {
    (void)c, (void)state;
    *size = sizeof(model);
    return fmi2Error;
}

EXPORT fmi2Status fmi2SerializeFMUstate(void *c, void *state, char bytes[], size_t size) {
    (void)c, (void)state, (void)bytes, (void)size;
    return fmi2Error;
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(void *c, const char bytes[], size_t size, void **state) {
    (void)c, (void)state, (void)bytes, (void)size;
    return fmi2Error;
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(void *c, const unsigned int unknown[], size_t n_unknown,
        const unsigned int known[], size_t n_known, const double seed[], double change[]) {
    (void)c, (void)unknown, (void)n_unknown, (void)known, (void)n_known, (void)seed, (void)change;
    return fmi2Error;
}

EXPORT fmi2Status fmi2SetRealInputDerivatives(void *c, const unsigned int references[], size_t n,
        const int order[], const double values[]) {
    (void)c, (void)references, (void)n, (void)order, (void)values;
    return fmi2Error;
}

EXPORT fmi2Status fmi2GetRealOutputDerivatives(void *c, const unsigned int references[], size_t n,
        const int order[], double values[]) {
    (void)c, (void)references, (void)n, (void)order, (void)values;
    return fmi2Error;
}

EXPORT fmi2Status fmi2DoStep(void *c, double now, double duration, int no_set_state) {
    (void)now, (void)no_set_state;
    instance *own = c;
    if (!advance(&own->model, duration)) {
        if (own->functions->logger != NULL) {
            own->functions->logger(own->functions->componentEnvironment, "@NAME@", fmi2Error,
                "logStatusError", "the communication step must be a multiple of the model's time step");
        }
        return fmi2Error;
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2CancelStep(void *c) {
    (void)c;
    return fmi2Error;
}

/* A step is over when it returns. */
#define NO_STATUS(NAME, TYPE)                            \
    EXPORT fmi2Status NAME(void *c, int kind, TYPE *value) { \
        (void)c, (void)kind, (void)value;                \
        return fmi2Discard;                              \
    }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetRealStatus, double)
NO_STATUS(fmi2GetIntegerStatus, int)
NO_STATUS(fmi2GetBooleanStatus, int)
NO_STATUS(fmi2GetStringStatus, const char *)
"""

_FMI3: Final = r"""
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void (*fmi3Log)(void *, fmi3Status, const char *, const char *);

/* An instance as the importer holds it: the model, and what to call. */
typedef struct {
    model model;
    void *environment;
    fmi3Log log;
} instance;

EXPORT const char *fmi3GetVersion(void) {
    return "3.0";
}

EXPORT fmi3Status fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const categories[]) {
    (void)c, (void)on, (void)n, (void)categories;
    return fmi3OK;
}

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources,
        bool visible, bool logging, bool events, bool early, const uint32_t intermediate[],
        size_t n_intermediate, void *environment, fmi3Log log, void (*update)(void)) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)events, (void)early;
    (void)intermediate, (void)n_intermediate, (void)update;
    if (token == NULL || strcmp(token, TOKEN) != 0) {
        return NULL;
    }
    instance *made = calloc(1, sizeof *made);
    if (made != NULL) {
        made->environment = environment;
        made->log = log;
        reset(&made->model);
    }
    return made;
}

/* It is for co-simulation only. */
EXPORT void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources,
        bool visible, bool logging, void *environment, fmi3Log log) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
    return NULL;
}

EXPORT void *fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *resources,
        bool visible, bool logging, void *environment, fmi3Log log, void (*update)(void), void (*lock)(void),
        void (*unlock)(void)) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
    (void)update, (void)lock, (void)unlock;
    return NULL;
}

EXPORT void fmi3FreeInstance(void *c) {
    free(c);
}

EXPORT fmi3Status fmi3EnterInitializationMode(void *c, bool tolerance_defined, double tolerance, double start,
        bool stop_defined, double stop) {
    (void)c, (void)tolerance_defined, (void)tolerance, (void)start, (void)stop_defined, (void)stop;
    return fmi3OK;
}

#define NOTHING_TO_DO(NAME)             \
    EXPORT fmi3Status NAME(void *c) {   \
        (void)c;                        \
        return fmi3OK;                  \
    }
NOTHING_TO_DO(fmi3ExitInitializationMode)
NOTHING_TO_DO(fmi3EnterStepMode)
NOTHING_TO_DO(fmi3Terminate)

EXPORT fmi3Status fmi3Reset(void *c) {
    reset(&((instance *)c)->model);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFloat64(void *c, const uint32_t references[], size_t n, double values[],
        size_t n_values) {
    for (size_t i = 0; i < n; i++) {
        if (i >= n_values || !get_value(&((instance *)c)->model, references[i], &values[i])) {
            return fmi3Error;
        }
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(void *c, const uint32_t references[], size_t n, const double values[],
        size_t n_values) {
    for (size_t i = 0; i < n; i++) {
        if (i >= n_values || !set_value(&((instance *)c)->model, references[i], values[i])) {
            return fmi3Error;
        }
    }
    return fmi3OK;
}

/* All variables are of type Float64. */
#define NO_VARIABLES(NAME, TYPE)                                                                           \
    EXPORT fmi3Status NAME(void *c, const uint32_t references[], size_t n, TYPE values[], size_t size) {   \
        (void)c, (void)references, (void)values, (void)size;                                               \
        return n == 0 ? fmi3OK : fmi3Error;                                                                \
    }
@NUMBERS@NO_VARIABLES(fmi3GetBoolean, bool)
NO_VARIABLES(fmi3SetBoolean, const bool)
NO_VARIABLES(fmi3GetString, const char *)
NO_VARIABLES(fmi3SetString, const char *const)

EXPORT fmi3Status fmi3GetBinary(void *c, const uint32_t references[], size_t n, size_t sizes[],
        const uint8_t *values[], size_t n_values) {
    (void)c, (void)references, (void)sizes, (void)values, (void)n_values;
    return n == 0 ? fmi3OK : fmi3Error;
}

EXPORT fmi3Status fmi3SetBinary(void *c, const uint32_t references[], size_t n, const size_t sizes[],
        const uint8_t *const values[], size_t n_values) {
    (void)c, (void)references, (void)sizes, (void)values, (void)n_values;
    return n == 0 ? fmi3OK : fmi3Error;
}

EXPORT fmi3Status fmi3GetFMUState(void *c, void **state) {
    if (*state == NULL) {
        *state = malloc(sizeof(model));
    }
    if (*state == NULL) {
        return fmi3Error;
    }
    memcpy(*state, &((instance *)c)->model, sizeof(model));
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFMUState(void *c, void *state) {
    memcpy(&((instance *)c)->model, state, sizeof(model));
    return fmi3OK;
}

EXPORT fmi3Status fmi3FreeFMUState(void *c, void **state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

EXPORT fmi3Status fmi3DoStep(void *c, double now, double duration, bool no_set_state, bool *event,
        bool *terminate, bool *early, double *last) {
    (void)no_set_state;
    instance *own = c;
    *event = *terminate = *early = false;
    *last = now;
    if (!advance(&own->model, duration)) {
        if (own->log != NULL) {
            own->log(own->environment, fmi3Error, "logStatusError",
                "the communication step must be a multiple of the model's time step");
        }
        return fmi3Error;
    }
    *last = now + duration;
    return fmi3OK;
}

/* What an FMU without events, clocks, derivatives and serialization refuses. */
#define REFUSED(NAME, ...)                      \
    EXPORT fmi3Status NAME(__VA_ARGS__);        \
    EXPORT fmi3Status NAME(__VA_ARGS__) {       \
        return fmi3Error;                       \
    }
#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
REFUSED(fmi3EnterEventMode, void *c)
REFUSED(fmi3EnterConfigurationMode, void *c)
REFUSED(fmi3ExitConfigurationMode, void *c)
REFUSED(fmi3EnterContinuousTimeMode, void *c)
REFUSED(fmi3EvaluateDiscreteStates, void *c)
REFUSED(fmi3GetClock, void *c, const uint32_t r[], size_t n, bool v[])
REFUSED(fmi3SetClock, void *c, const uint32_t r[], size_t n, const bool v[])
REFUSED(fmi3GetNumberOfVariableDependencies, void *c, uint32_t r, size_t *n)
REFUSED(fmi3GetVariableDependencies, void *c, uint32_t r, size_t d[], uint32_t i[], size_t e[], int k[],
    size_t n)
REFUSED(fmi3SerializedFMUStateSize, void *c, void *s, size_t *n)
REFUSED(fmi3SerializeFMUState, void *c, void *s, uint8_t b[], size_t n)
REFUSED(fmi3DeserializeFMUState, void *c, const uint8_t b[], size_t n, void **s)
REFUSED(fmi3GetDirectionalDerivative, void *c, const uint32_t u[], size_t n, const uint32_t k[], size_t m,
    const double s[], size_t o, double v[], size_t p)
REFUSED(fmi3GetAdjointDerivative, void *c, const uint32_t u[], size_t n, const uint32_t k[], size_t m,
    const double s[], size_t o, double v[], size_t p)
REFUSED(fmi3GetIntervalDecimal, void *c, const uint32_t r[], size_t n, double v[], int q[])
REFUSED(fmi3GetIntervalFraction, void *c, const uint32_t r[], size_t n, uint64_t v[], uint64_t w[], int q[])
REFUSED(fmi3GetShiftDecimal, void *c, const uint32_t r[], size_t n, double v[])
REFUSED(fmi3GetShiftFraction, void *c, const uint32_t r[], size_t n, uint64_t v[], uint64_t w[])
REFUSED(fmi3SetIntervalDecimal, void *c, const uint32_t r[], size_t n, const double v[])
REFUSED(fmi3SetIntervalFraction, void *c, const uint32_t r[], size_t n, const uint64_t v[],
    const uint64_t w[])
REFUSED(fmi3SetShiftDecimal, void *c, const uint32_t r[], size_t n, const double v[])
REFUSED(fmi3SetShiftFraction, void *c, const uint32_t r[], size_t n, const uint64_t v[], const uint64_t w[])
REFUSED(fmi3UpdateDiscreteStates, void *c, bool *a, bool *b, bool *d, bool *e, bool *f, double *t)
REFUSED(fmi3CompletedIntegratorStep, void *c, bool n, bool *e, bool *t)
REFUSED(fmi3SetTime, void *c, double t)
REFUSED(fmi3SetContinuousStates, void *c, const double x[], size_t n)
REFUSED(fmi3GetContinuousStateDerivatives, void *c, double x[], size_t n)
REFUSED(fmi3GetEventIndicators, void *c, double x[], size_t n)
REFUSED(fmi3GetContinuousStates, void *c, double x[], size_t n)
REFUSED(fmi3GetNominalsOfContinuousStates, void *c, double x[], size_t n)
REFUSED(fmi3GetNumberOfEventIndicators, void *c, size_t *n)
REFUSED(fmi3GetNumberOfContinuousStates, void *c, size_t *n)
REFUSED(fmi3GetOutputDerivatives, void *c, const uint32_t r[], size_t n, const int32_t o[], double v[],
    size_t m)
REFUSED(fmi3ActivateModelPartition, void *c, uint32_t r, double t)
"""

WRAPPERS: Final[Mapping[int, str]] = {2: _FMI2, 3: _FMI3}
"""The functions of each version of the standard."""


def wrapper_code(source: Source, version: int) -> str:
    """The text of ``fmu.c``; ``@TOKEN@`` stands for the FMU's identity."""
    get, put, start, reference = [], [], [], 0
    for signals, struct in ((source.inputs, "input"), (source.outputs, "output")):
        for one in signals:
            kind = f"{source.name}_real" if one.kind == "real" else one.kind
            for k, (_, place) in enumerate(one.entries()):
                case = f"        case {reference}:\n            "
                get.append(f"{case}*value = (double)m->{struct}.{place};\n            break;\n")
                if struct == "input":
                    put.append(f"{case}m->{struct}.{place} = ({kind})value;\n            break;\n")
                    if one.name.startswith("force") and k == 2:
                        start.append(f"    m->{struct}.{place} = ({kind})-{GRAVITY};\n")
                elif one.name in source.initial:
                    start.append(
                        f"    m->{struct}.{place} = ({kind}){float(source.initial[one.name][k])!r};\n"
                    )
                reference += 1
    numbers = (
        ["Float32", "float"],
        *([f"{u}Int{n}", f"{u.lower()}int{n}_t"] for u in ("", "U") for n in (8, 16, 32, 64)),
    )
    listed = "".join(
        f"NO_VARIABLES(fmi3Get{name}, {kind})\nNO_VARIABLES(fmi3Set{name}, const {kind})\n"
        for name, kind in numbers
    )
    text = _CORE + WRAPPERS[version]
    for key, value in {
        "ABOUT": source.about,
        "VERSION": str(version),
        "NAME": source.name,
        "UPPER": source.name.upper(),
        "START": "".join(start),
        "GET": "".join(get),
        "SET": "".join(put),
        "NUMBERS": listed,
    }.items():
        text = text.replace(f"@{key}@", value)
    return text
