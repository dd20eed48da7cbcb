"""Validates a JSON document against the schema that its own head names (protocol/document/schemas)."""
import json
from pathlib import Path

from jsonschema import Draft202012Validator, RefResolver

FOLDER = Path(__file__).resolve().parents[2] / "protocol" / "document" / "schemas"
HEAD = ("schema", "program", "input")
SCHEMAS = {schema["$id"]: schema for schema in
           (json.loads(file.read_text(encoding="utf-8")) for file in sorted(FOLDER.glob("*.schema.json")))}


def faults(document):
    """What is wrong with a document, one line each; empty where it follows its schema."""
    head = document.get("schema")
    if not isinstance(head, dict) or "name" not in head or "version" not in head:
        return ["no head: \"schema\" with name and version expected"]
    identifier = f"urn:selfcal:schema:{str(head['name']).removeprefix('selfcal.')}:{head['version']}"
    if identifier not in SCHEMAS:
        return [f"schema {head['name']} version {head['version']}: no file in {FOLDER.name}/"]
    heads = [key for key in document if key in HEAD]
    if list(document)[:len(heads)] != [key for key in HEAD if key in document]:
        return [f"the head is not first, in its order: {', '.join(list(document)[:4])}"]
    schema = SCHEMAS[identifier]
    validator = Draft202012Validator(schema, resolver=RefResolver.from_schema(schema, store=SCHEMAS))
    return [f"{'.'.join(str(part) for part in error.absolute_path) or 'document'}: {error.message[:200]}"
            for error in validator.iter_errors(document)]


def text_faults(text):
    """The same from text, which must be one JSON document without NaN or infinity."""
    try:
        return faults(json.loads(text, parse_constant=lambda word: (_ for _ in ()).throw(ValueError(word))))
    except ValueError as error:
        return [f"not one JSON document: {error}"]
