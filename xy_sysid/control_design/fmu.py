"""The program as a functional mock-up unit for co-simulation (FMI 2.0.4): its description and its C source, to be packed with a binary.

One input ``u`` that is held, two outputs: the position ``y`` that the encoder shows, and the axis' speed ``v``. A communication step is a whole
number of samples. Source: Modelica Association, Functional Mock-up Interface for Model Exchange and Co-Simulation, version 2.0.4, 2022.
"""

from __future__ import annotations

import hashlib
from xml.sax.saxutils import quoteattr

from xy_sysid.control_design.program import Program
from xy_sysid.control_design.to_c import source
from xy_sysid.units import Units

BASES = {  # exponents of SI units
    "V": 'kg="1" m="2" s="-3" A="-1"',
    "A": 'A="1"',
    "N": 'kg="1" m="1" s="-2"',
    "N m": 'kg="1" m="2" s="-2"',
    "m": 'm="1"',
    "m/s": 'm="1" s="-1"',
    "rad": 'rad="1"',
    "rad/s": 'rad="1" s="-1"',
}
FUNCTIONS = """\
/* FMI 2.0 for co-simulation, with the types that its headers define */
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
typedef void *fmi2Component;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean, fmi2Status, fmi2Type, fmi2StatusKind;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef void *fmi2FMUstate;
typedef struct { void *logger, *allocate, *free, *finished, *environment; } fmi2CallbackFunctions;
enum { OK = 0, DISCARD = 2, ERROR = 3 };

typedef struct { NAME_state axis; double u, y, t; } unit;

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    (void)c; (void)on; (void)n; (void)names; return OK;
}
EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String id, fmi2String place,
    const fmi2CallbackFunctions *calls, fmi2Boolean visible, fmi2Boolean log)
{
    (void)name; (void)place; (void)calls; (void)visible; (void)log;
    if (type != 1 || strcmp(id, GUID) != 0) return NULL;
    unit *made = calloc(1, sizeof(unit));
    if (made) NAME_reset(&made->axis);
    return made;
}
EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }
EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean given, fmi2Real tolerance, fmi2Real start, fmi2Boolean ends, fmi2Real stop)
{
    (void)given; (void)tolerance; (void)ends; (void)stop;
    ((unit *)c)->t = start;
    return OK;
}
EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return OK; }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return OK; }
EXPORT fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return OK; }
EXPORT fmi2Status fmi2Reset(fmi2Component c) { unit *own = c; memset(own, 0, sizeof *own); NAME_reset(&own->axis); return OK; }
EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real out[])
{
    unit *own = c;
    for (size_t k = 0; k < n; k++) {
        if (r[k] > 2) return ERROR;
        out[k] = r[k] == 0 ? own->u : r[k] == 1 ? own->y : own->axis.s[1];
    }
    return OK;
}
EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real in[])
{
    for (size_t k = 0; k < n; k++) {
        if (r[k] != 0) return ERROR;
        ((unit *)c)->u = in[k];
    }
    return OK;
}
EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real at, fmi2Real size, fmi2Boolean keep)
{
    unit *own = c;
    double samples = size * RATE;
    long count = (long)(samples + 0.5);
    (void)at; (void)keep;
    if (count < 1 || samples - count > 1e-6 * count || count - samples > 1e-6 * count) return DISCARD;
    for (long k = 0; k < count; k++) own->y = NAME_step(&own->axis, own->u);
    own->t += size;
    return OK;
}
#define NONE(name, type) \\
    EXPORT fmi2Status fmi2Get##name(fmi2Component c, const fmi2ValueReference r[], size_t n, type out[]) \\
    { (void)c; (void)r; (void)out; return n ? ERROR : OK; } \\
    EXPORT fmi2Status fmi2Set##name(fmi2Component c, const fmi2ValueReference r[], size_t n, const type in[]) \\
    { (void)c; (void)r; (void)in; return n ? ERROR : OK; }
NONE(Integer, fmi2Integer)
NONE(Boolean, fmi2Boolean)
NONE(String, fmi2String)
EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer o[], const fmi2Real v[])
{
    (void)c; (void)r; (void)o; (void)v; return n ? ERROR : OK;
}
EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer o[], fmi2Real v[])
{
    (void)c; (void)r; (void)o; (void)v; return n ? ERROR : OK;
}
EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return ERROR; }
EXPORT fmi2Status fmi2GetStatus(fmi2Component c, fmi2StatusKind k, fmi2Status *v) { (void)c; (void)k; (void)v; return DISCARD; }
EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, fmi2StatusKind k, fmi2Real *v) { *v = ((unit *)c)->t; return k == 2 ? OK : DISCARD; }
EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, fmi2StatusKind k, fmi2Integer *v) { (void)c; (void)k; (void)v; return DISCARD; }
EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, fmi2StatusKind k, fmi2Boolean *v) { (void)c; (void)k; (void)v; return DISCARD; }
EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, fmi2StatusKind k, fmi2String *v) { (void)c; (void)k; (void)v; return DISCARD; }
EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s)
{
    if (!*s) *s = malloc(sizeof(unit));
    if (!*s) return ERROR;
    memcpy(*s, c, sizeof(unit));
    return OK;
}
EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) { memcpy(c, s, sizeof(unit)); return OK; }
EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { (void)c; free(*s); *s = NULL; return OK; }
EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate s, size_t *n) { (void)c; (void)s; *n = sizeof(unit); return OK; }
EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n)
{
    (void)c; if (n < sizeof(unit)) return ERROR; memcpy(b, s, sizeof(unit)); return OK;
}
EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
{
    (void)c; if (n < sizeof(unit)) return ERROR; if (!*s) *s = malloc(sizeof(unit)); if (!*s) return ERROR; memcpy(*s, b, sizeof(unit));
    return OK;
}
EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t nu, const fmi2ValueReference k[],
    size_t nk, const fmi2Real d[], fmi2Real v[])
{
    (void)c; (void)u; (void)nu; (void)k; (void)nk; (void)d; (void)v; return ERROR;
}
"""


def files(of: Program, name: str, title: str, units: Units) -> dict[str, str]:
    """modelDescription.xml and the sources, by their paths in the archive; the binary is compiled from ``sources/NAME_fmu.c``."""
    header, text = source(of, name, title)
    guid = "{" + hashlib.sha256(text.encode()).hexdigest()[:32] + "}"
    rows = (("u", 0, "input", "input", units.input), ("y", 1, "output", "position", units.output), ("v", 2, "output", "speed", units.speed))
    variables = "\n".join(_variable(*row) for row in rows)
    defined = "\n".join(_unit(row[-1]) for row in rows)
    described = f"""\
<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName={quoteattr(name)} guid="{guid}"
  description={quoteattr(title)} generationTool="xy_sysid" numberOfEventIndicators="0">
  <CoSimulation modelIdentifier={quoteattr(name)} canHandleVariableCommunicationStepSize="true"
    canGetAndSetFMUstate="true" canSerializeFMUstate="true">
    <SourceFiles><File name="{name}_fmu.c"/></SourceFiles>
  </CoSimulation>
  <UnitDefinitions>
{defined}
  </UnitDefinitions>
  <DefaultExperiment startTime="0" stepSize="{1.0 / of.rate!r}"/>
  <ModelVariables>
{variables}
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies=""/><Unknown index="3" dependencies=""/></Outputs>
    <InitialUnknowns><Unknown index="2" dependencies=""/><Unknown index="3" dependencies=""/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""
    whole = f'#include "{name}.c"\n#define GUID "{guid}"\n#define RATE {of.rate!r}\n' + FUNCTIONS.replace("NAME", name)
    return {"modelDescription.xml": described, f"sources/{name}.h": header, f"sources/{name}.c": text, f"sources/{name}_fmu.c": whole}


def _variable(name: str, reference: int, causality: str, told: str, unit: str) -> str:
    start = ' start="0"' if causality == "input" else ""
    head = f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" variability="continuous"'
    return f"    {head} description={quoteattr(told)}><Real unit={quoteattr(unit)}{start}/></ScalarVariable>"


def _unit(name: str) -> str:
    """The definition of a unit, with its SI exponents if they are known."""
    powers = BASES.get(name)
    return f"    <Unit name={quoteattr(name)}>{'' if powers is None else f'<BaseUnit {powers}/>'}</Unit>"
