#!/usr/bin/python3
"""The JSON Schemas against an independent validator: every shipped file passes, and what the readers refuse does not.

usage: schema_test.py SOURCE_DIR
"""
import copy
import glob
import json
import os
import sys

import jsonschema
import yaml

config = os.path.join(sys.argv[1], "config")
failures = []


def validator(name):
    with open(os.path.join(config, "schema", name)) as file:
        schema = json.load(file)
    jsonschema.Draft7Validator.check_schema(schema)
    return jsonschema.Draft7Validator(schema)


def load(path):
    with open(path) as file:
        return yaml.safe_load(file)


def accept(judge, path):
    for error in judge.iter_errors(load(path)):
        failures.append(f"{path}: {'.'.join(map(str, error.path))}: {error.message}")


model, scenario = validator("model.schema.json"), validator("scenario.schema.json")
models = [path for path in sorted(glob.glob(os.path.join(config, "*.yaml"))) if "masses" in load(path)]
scenarios = sorted(glob.glob(os.path.join(config, "scenarios", "*.yaml")))
assert len(models) >= 9 and len(scenarios) >= 25
for path in models:
    accept(model, path)
for path in scenarios:
    accept(scenario, path)

tractor = load(os.path.join(config, "tractor.yaml"))
converter = load(os.path.join(config, "converter_tractor.yaml"))


def refuse(what, change, machine=tractor):
    changed = copy.deepcopy(machine)
    change(changed)
    if model.is_valid(changed):
        failures.append(f"the schema accepts {what}")


refuse("a negative inertia", lambda m: m["masses"]["engine"].update(inertia_kg_m2=-2.6))
refuse("a misspelt key", lambda m: m["masses"]["engine"].update(inertai_kg_m2=2.6))
refuse("a missing efficiency", lambda m: m["gears"]["P1"].pop("efficiency"))
refuse("ratio beside teeth", lambda m: m["gears"]["P1"].update(ratio=2))
refuse("a clutch without a friction law", lambda m: m["clutches"]["Fc"].pop("dry"))
refuse("two actuations", lambda m: m["clutches"]["Fc"].update(constant={}))
refuse("a ratio of 0", lambda m: m["gears"]["PR"].update(ratio=0))
refuse("an unknown section", lambda m: m.update(cluches={}))
refuse("plates without a hole", lambda m: m["clutches"]["F1"]["wet_plates"].update(inner_radius_m=0))
refuse("a plough without draft", lambda m: m["ploughs"]["plough"].update(a=0))
refuse("an engine without torque before its boost", lambda m: m["engines"]["engine"].update(turbo_instant_fraction=0))
refuse("a converter whose pump takes endless torque",
       lambda m: m["converters"]["converter"].update(k_over_speed_ratio_rad_s_per_sqrt_nm=[[0, 6.6], [1, 0]]), converter)
refuse("a speed ratio beyond 1",
       lambda m: m["converters"]["converter"].update(torque_ratio_over_speed_ratio=[[0, 2.5], [1.5, 0]]), converter)

print("\n".join(failures) or f"{len(models)} models, {len(scenarios)} scenarios")
sys.exit(1 if failures else 0)
