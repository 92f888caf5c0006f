"""Croissant metadata (JSON-LD): dataset search engines and loaders read the trial table by it.

Written for Croissant 1.0, https://docs.mlcommons.org/croissant/docs/croissant-spec.html.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from logs.dataset.dataset import Dataset
from logs.export.columns import Column, Kind, columns, scored_models
from logs.numbers import counted

CROISSANT_NAME = "croissant.json"
_TYPES: Mapping[Kind, str] = {
    "text": "sc:Text",
    "integer": "sc:Integer",
    "number": "sc:Float",
    "truth": "sc:Boolean",
    "numbers": "sc:Float",
    "texts": "sc:Text",
}
_FORMATS = {
    "trials.parquet": "application/x-parquet",
    "trials.csv": "text/csv",
}
_CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}


def croissant_bytes(dataset: Dataset, hashes: Mapping[str, str]) -> bytes:
    """The description of a data set's files.

    Args:
        dataset: what lies in the folder.
        hashes: SHA-256 of each file by path; the table is described from Parquet if it is there,
            else from CSV, and not at all if there is neither.
    """
    tables = [name for name in _FORMATS if name in hashes]
    kind = "Simulated" if dataset.simulated else "Physical"
    content: dict[str, Any] = {
        "@context": _CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": dataset.name,
        "description": (
            f"{kind} grasp trials with success labels: "
            f"{counted(len(dataset.trials), 'trial')} of "
            f"{counted(len(dataset.objects), 'object')}. {dataset.origin}"
        ),
        "license": dataset.license or "not stated",
        "isLiveDataset": False,
        "distribution": [_file(name, hashes[name]) for name in tables],
        "recordSet": [_record_set(dataset, tables[0])] if tables else [],
    }
    return (json.dumps(content, indent=1) + "\n").encode()


def _file(name: str, digest: str) -> dict[str, Any]:
    return {
        "@type": "cr:FileObject",
        "@id": name,
        "name": name,
        "contentUrl": name,
        "encodingFormat": _FORMATS[name],
        "sha256": digest,
    }


def _record_set(dataset: Dataset, table: str) -> dict[str, Any]:
    wanted = columns(scored_models(dataset.trials))
    return {
        "@type": "cr:RecordSet",
        "@id": "trials",
        "name": "trials",
        "description": "One row a trial that counts: labeled, not voided.",
        "key": {"@id": "trials/trial_id"},
        "field": [_field(column, table) for column in wanted],
    }


def _field(column: Column, table: str) -> dict[str, Any]:
    unit = f" [{column.unit}]" if column.unit else ""
    as_list = column.kind in ("numbers", "texts") and table.endswith(".parquet")
    in_csv = column.kind in ("numbers", "texts") and not as_list
    field: dict[str, Any] = {
        "@type": "cr:Field",
        "@id": f"trials/{column.name}",
        "name": column.name,
        "description": column.meaning + unit + (", JSON" if in_csv else ""),
        "dataType": "sc:Text" if in_csv else _TYPES[column.kind],
        "source": {"fileObject": {"@id": table}, "extract": {"column": column.name}},
    }
    if as_list:
        field["repeated"] = True
    return field
