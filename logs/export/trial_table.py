"""The trial table as Parquet and CSV; both are read back exactly."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from logs.dataset.labeled_trial import LabeledTrial
from logs.errors import DatasetError
from logs.export.columns import Column, Kind, columns, scored_models, trial_of_row

PARQUET_NAME = "trials.parquet"
CSV_NAME = "trials.csv"
LINE_END = "\n"


def parquet_bytes(trials: Sequence[LabeledTrial]) -> bytes:
    """The table as a Parquet file; units and meanings are the fields' metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    wanted = columns(scored_models(trials))
    schema = pa.schema([_field(column) for column in wanted])
    arrays = [
        pa.array([column.value(trial) for trial in trials], type=field.type)
        for column, field in zip(wanted, schema, strict=True)
    ]
    stream = io.BytesIO()
    pq.write_table(pa.Table.from_arrays(arrays, schema=schema), stream, compression="zstd")
    return stream.getvalue()


def csv_bytes(trials: Sequence[LabeledTrial]) -> bytes:
    """The table as CSV: numbers with all digits, lists as JSON, missing values empty."""
    wanted = columns(scored_models(trials))
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator=LINE_END)
    writer.writerow([column.name for column in wanted])
    for trial in trials:
        writer.writerow([_to_cell(column.value(trial), column.kind) for column in wanted])
    return stream.getvalue().encode()


def read_parquet(path: Path) -> tuple[LabeledTrial, ...]:
    """Read a table that [parquet_bytes][] wrote.

    Raises:
        DatasetError: unreadable, or not such a table.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        rows = pq.ParquetFile(path).read().to_pylist()  # read_table loads pandas first
    except (OSError, pa.ArrowInvalid) as error:
        raise DatasetError(f"cannot read {path}: {error}") from error
    return _trials(rows, path)


def read_csv(path: Path) -> tuple[LabeledTrial, ...]:
    """Read a table that [csv_bytes][] wrote.

    Raises:
        DatasetError: unreadable, or not such a table.
    """
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DatasetError(f"cannot read {path}: {error}") from error
    known = {column.name: column for column in columns(_models_in(rows))}
    decoded = []
    for number, row in enumerate(rows, start=2):
        try:
            decoded.append({name: _from_cell(text, known[name]) for name, text in row.items()})
        except (KeyError, ValueError, TypeError) as error:
            raise DatasetError(f"{path}: line {number}: {error}") from error
    return _trials(decoded, path)


def _models_in(rows: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    """Names of the models that have a score column."""
    names = rows[0] if rows else {}
    suffix = "_version"
    return tuple(
        name.removeprefix("score_").removesuffix(suffix)
        for name in names
        if str(name).startswith("score_") and str(name).endswith(suffix)
    )


def _trials(rows: Sequence[dict[str, Any]], path: Path) -> tuple[LabeledTrial, ...]:
    models = _models_in(rows)
    try:
        return tuple(trial_of_row(row, models) for row in rows)
    except (KeyError, TypeError, ValueError) as error:
        raise DatasetError(f"{path} is no trial table of this project: {error}") from error


def _field(column: Column) -> Any:
    import pyarrow as pa

    types: dict[Kind, Any] = {
        "text": pa.string(),
        "integer": pa.int64(),
        "number": pa.float64(),
        "truth": pa.bool_(),
        "numbers": pa.list_(pa.float64()),
        "texts": pa.list_(pa.string()),
    }
    metadata = {"meaning": column.meaning, "unit": column.unit}
    return pa.field(column.name, types[column.kind], column.nullable, metadata)


def _to_cell(value: Any, kind: Kind) -> str:
    if value is None:
        return ""
    if kind in ("numbers", "texts"):
        return json.dumps(value)
    if kind == "truth":
        return "true" if value else "false"
    return repr(float(value)) if kind == "number" else str(value)


def _from_cell(text: str, column: Column) -> Any:
    if text == "" and (column.nullable or column.kind not in ("text",)):
        if not column.nullable:
            raise ValueError(f"column {column.name!r} is empty")
        return None
    match column.kind:
        case "text":
            return text
        case "truth":
            return {"true": True, "false": False}[text]
        case "integer":
            return int(text)
        case "number":
            return float(text)
        case _:
            return json.loads(text)
