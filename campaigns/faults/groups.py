"""The groups of attacks: modules, and their titles."""

from __future__ import annotations

GROUPS = {
    "encoder": "Encoder",
    "motion": "Limits",
    "damage": "Changed bytes",
    "hostile": "Files made to harm",
    "disk": "Full disk",
    "endings": "Ctrl-C, SIGTERM, kill -9",
    "strange": "Strange signals and effect files",
    "machine": "The machine, over DDS",
    "door": "The page's server",
    "tabs": "The page under load",
    "network": "Two hosts",
    "shared": "Recordings of real machines",
}
