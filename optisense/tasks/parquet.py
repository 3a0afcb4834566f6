"""Export of a dataset as Parquet files, which machine-learning libraries load without a script.

A file is a table with a row for each sample: its picture as PNG, its arrays, its labels. The types
of the columns are stored like those of Hugging Face's `datasets`, as features in the table's
metadata; with PyArrow alone the arrays are nested lists.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import OutputError, SetupError, TaskError
from optisense.folders import held
from optisense.tasks._records import KEPT
from optisense.tasks._splits import SPLITS, TRAIN
from optisense.tasks.dataset import LATER_ARRAYS, SAMPLE_ARRAYS, Dataset, Sample
from optisense.tasks.dataset_tables import NUMBER_COLUMNS, WHOLE_COLUMNS
from optisense.untrusted_files import MOST_PICTURE, read_bytes
from optisense.writing import inside, written_together

FOLDER = "parquet"

SAMPLES_OF_A_FILE = 256
"""Number of samples in a file; at 320 x 240 pixels it has 500 MB, as dataset hubs recommend."""

SAMPLES_AT_ONCE = 16
"""Number of samples that are in memory at once, some 60 MB at 320 x 240 pixels; they are a row
group of the file."""

OWN_FILE = re.compile(rf"(?:{'|'.join(SPLITS)})-\d{{5}}-of-\d{{5}}\.parquet")

ARRAYS = {**SAMPLE_ARRAYS, **LATER_ARRAYS}
"""Arrays of a sample: the kinds of their numbers, and the number of values per pixel."""

TYPES = {"f": "float32", "b": "bool"}
"""Types of the columns of arrays by the kind of their numbers."""

TEXTS = ("indenter", "split")

RENAMED = {"depth": "press_depth", "pressure": "greatest_pressure"}
"""Labels with the name of an array, and the names of their columns."""

NUMBERS = {each: RENAMED.get(each, each) for each in NUMBER_COLUMNS}
"""Name of the column of each numeric label."""


def require_parquet() -> None:
    """Raise SetupError if the extra that writes Parquet files is not installed."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as error:
        raise SetupError(
            "writing Parquet files needs PyArrow, which is not installed",
            hint="pip install 'optisense[parquet]', or leave --parquet out and delete the folder "
            f"'{FOLDER}' of the dataset, if it is there",
        ) from error


def parquet_files(folder: Path) -> list[Path]:
    """Return the files that `write_parquet` has written into a dataset's folder, by name."""
    found = (folder / FOLDER).glob("*.parquet")
    return sorted(file for file in found if OWN_FILE.fullmatch(file.name))


def has_all_samples(dataset: Dataset) -> bool:
    """Return whether the files in a dataset's folder hold each of its samples once.

    Raises:
        SetupError: the extra is not installed.
    """
    require_parquet()
    import pyarrow as pa
    import pyarrow.parquet as pq

    found: list[int] = []
    try:
        for file in parquet_files(dataset.folder):
            with pq.ParquetFile(file) as table:
                found += table.read(columns=["index"])["index"].to_pylist()
    except (OSError, KeyError, pa.ArrowException):
        return False
    return sorted(found) == sorted(row["index"] for row in dataset.labels)


def write_parquet(
    dataset: Dataset, progress: Callable[[int, int], None] | None = None
) -> list[Path]:
    """Write all samples into the folder `parquet` of a dataset, a few files for each split.

    Samples of a release without splits are all in "train". The files appear together, in place of
    those of an earlier call, which stay if this one fails or is interrupted. The earlier ones are
    removed last, so that a kill never leaves the folder without a complete set.

    Args:
        progress: function that is called with the number of samples written and their total number.

    Returns:
        The files.

    Raises:
        SetupError: the extra is not installed.
        TaskError: a sample is damaged.
        FolderInUseError: another process is writing to the dataset.
        OutputError: a file can't be written or removed.
    """
    require_parquet()
    done, files = 0, []

    def report(count: int) -> None:
        nonlocal done
        done += count
        if progress is not None:
            progress(done, len(dataset))

    with held(dataset.folder):
        with written_together("the results", kept=KEPT) as stage:
            for split in SPLITS:
                numbers = [
                    k for k, row in enumerate(dataset.labels) if (row["split"] or TRAIN) == split
                ]
                count = math.ceil(len(numbers) / SAMPLES_OF_A_FILE)
                for part in range(count):
                    of_file = numbers[part * SAMPLES_OF_A_FILE : (part + 1) * SAMPLES_OF_A_FILE]
                    name = f"{FOLDER}/{split}-{part:05d}-of-{count:05d}.parquet"
                    file = inside(dataset.folder, name)
                    _write(stage(file), dataset, of_file, report)
                    files.append(file)
        if files:
            _remove(set(parquet_files(dataset.folder)) - set(files))
    return files


def _remove(earlier: Iterable[Path]) -> None:
    """Remove the files of an earlier call once those of this one are there."""
    try:
        for file in earlier:
            file.unlink()
    except OSError as error:
        raise OutputError.of(error) from error


def _write(
    path: Path, dataset: Dataset, numbers: Sequence[int], report: Callable[[int], None]
) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    width, height = dataset.info["settings"]["resolution"]
    features = features_of(int(height), int(width))
    metadata = {"huggingface": json.dumps({"info": {"features": features}})}
    schema = pa.schema([_field(name, each) for name, each in features.items()], metadata=metadata)
    with pq.ParquetWriter(path, schema, compression="zstd") as writer:
        for start in range(0, len(numbers), SAMPLES_AT_ONCE):
            some = numbers[start : start + SAMPLES_AT_ONCE]
            columns = _columns(dataset, some, features)
            arrays = [columns[field.name] for field in schema]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))
            report(len(some))


def features_of(height: int, width: int) -> dict[str, Any]:
    """Return the types of the columns, as Hugging Face's `datasets` writes them, for pictures of a
    size in pixels.
    """
    found: dict[str, Any] = {"image": {"_type": "Image"}}
    for name, (kind, channels) in ARRAYS.items():
        shape = [height, width] if channels is None else [height, width, channels]
        found[name] = {"shape": shape, "dtype": TYPES[kind], "_type": f"Array{len(shape)}D"}
    found |= {name: {"dtype": "string", "_type": "Value"} for name in TEXTS}
    found |= {name: {"dtype": "int64", "_type": "Value"} for name in WHOLE_COLUMNS}
    found |= {name: {"dtype": "float64", "_type": "Value"} for name in NUMBERS.values()}
    return found


def _field(name: str, feature: dict[str, Any]) -> Any:
    """Return a column's field. Columns of arrays have metadata with their shape for `datasets`, and
    are lists to other readers.
    """
    import pyarrow as pa

    metadata = None
    if "shape" in feature:
        metadata = {
            "ARROW:extension:name": f"datasets.features.features.{feature['_type']}ExtensionType",
            "ARROW:extension:metadata": json.dumps([feature["shape"], feature["dtype"]]),
        }
    return pa.field(name, _arrow_type(feature), metadata=metadata)


def _arrow_type(feature: dict[str, Any]) -> Any:
    import pyarrow as pa

    if feature["_type"] == "Image":
        return pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    plain = {
        "float32": pa.float32(), "float64": pa.float64(), "int64": pa.int64(),
        "bool": pa.bool_(), "string": pa.string(),
    }[feature["dtype"]]  # fmt: skip
    for _ in feature.get("shape", ()):
        plain = pa.list_(plain)
    return plain


def _columns(dataset: Dataset, numbers: Sequence[int], features: dict[str, Any]) -> dict[str, Any]:
    """Return samples as Arrow arrays, by column."""
    import pyarrow as pa

    samples = [dataset[number] for number in numbers]
    rows = [sample.labels for sample in samples]
    pictures = [_picture(dataset, sample) for sample in samples]
    found: dict[str, Any] = {"image": pa.array(pictures, _arrow_type(features["image"]))}
    for name in ARRAYS:
        found[name] = _nested([getattr(sample, name) for sample in samples], features[name])
    for name, label in {**{each: each for each in (*TEXTS, *WHOLE_COLUMNS)}, **NUMBERS}.items():
        values = [None if row[name] != row[name] else row[name] for row in rows]  # NaN: unknown
        found[label] = pa.array(values, _arrow_type(features[label]))
    return found


def _picture(dataset: Dataset, sample: Sample) -> dict[str, object]:
    name = sample.labels["file_name"]
    content = read_bytes(dataset.folder / name, MOST_PICTURE, TaskError, "the picture")
    return {"bytes": content, "path": Path(name).name}


def _nested(arrays: Sequence[NDArray[Any] | None], feature: dict[str, Any]) -> Any:
    """Return arrays of one shape as nested lists; missing arrays are null."""
    import pyarrow as pa

    shape = tuple(feature["shape"])
    known = [each for each in arrays if each is not None]
    flat = np.concatenate([np.ascontiguousarray(each).ravel() for each in known] or [np.zeros(0)])
    values = pa.array(flat.astype(feature["dtype"]))
    for axis in range(len(shape) - 1, 0, -1):
        lists = len(known) * math.prod(shape[:axis])
        offsets = np.arange(lists + 1, dtype=np.int32) * shape[axis]
        values = pa.ListArray.from_arrays(pa.array(offsets), values)
    ends = (np.cumsum([0, *(each is not None for each in arrays)]) * shape[0]).tolist()
    missing = [*(each is None for each in arrays), False]
    offsets = [None if gone else end for end, gone in zip(ends, missing, strict=True)]
    return pa.ListArray.from_arrays(pa.array(offsets, pa.int32()), values)
