"""The built-in printable parts, and parts from mesh files."""

from __future__ import annotations

from collection.objects.catalog import CATALOG, OBJECT_NAMES, BuiltIn
from collection.objects.loading import load_object, load_objects

__all__ = ["CATALOG", "OBJECT_NAMES", "BuiltIn", "load_object", "load_objects"]
