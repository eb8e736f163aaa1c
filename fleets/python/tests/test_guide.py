"""The Python of the guide's page of fleets, as it stands there: each engine gives the bits that the functions of SQL give.

`test_guide.py COMMAND`: the command is `straightline-query`. Without an engine the test fails.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

PROJECT = Path(__file__).resolve().parents[3]
ROWS = 3000
#: A row whose velocities are null.
WITHOUT = 17


def log():
    """Rows of a log of the Panda, to four decimals."""
    t = np.arange(ROWS)[:, None] / 100.0
    w = 0.9 + 0.4 * np.arange(7)
    motion = [0.7 * np.sin(w * t), 0.7 * w * np.cos(w * t), -0.7 * w * w * np.sin(w * t)]
    lists = [np.round(x, 4).tolist() for x in motion]
    lists[1][WITHOUT] = None
    columns = {name: pa.array(rows) for name, rows in zip(["q", "qd", "qdd"], lists)}
    return pa.table({"id": pa.array(range(ROWS), pa.uint32()), **columns})


def bits(table):
    """Key, whether there is a result, and its bits, in the order of keys."""
    rows = table.select(["id", "tau"]).sort_by("id").to_pylist()
    return [(row["id"], row["tau"] and [x.hex() for x in row["tau"].values()]) for row in rows]


def main(command):
    page = (PROJECT / "guide/src/fleets.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert len(blocks) == 4, f"{len(blocks)} blocks of Python on the page"
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        shutil.copy(PROJECT / "robots/descriptions/panda.urdf", folder)
        pq.write_table(log(), "log.parquet")
        sql = "SELECT id, inverse_dynamics('panda.urdf', q, qd, qdd) AS tau FROM logs"
        subprocess.run([command, "-o", "wanted.parquet", sql, "log.parquet"], check=True)
        wanted = bits(pq.read_table("wanted.parquet"))
        assert len(wanted) == ROWS and [key for key, tau in wanted if tau is None] == [WITHOUT]
        names = {}
        for block in blocks:
            exec(compile(block, "guide/src/fleets.md", "exec"), names)
        found = {
            "DataFusion": names["by_datafusion"],
            "Polars": names["by_polars"].to_arrow(),
            "Ray": pa.concat_tables(names["by_ray"].iter_batches(batch_size=None, batch_format="pyarrow")),
        }
        for engine, table in found.items():
            assert bits(table) == wanted, engine
            print(f"{engine}: {table.num_rows} rows with the bits of SQL")
        names["ray"].shutdown()
        os.chdir(PROJECT)


main(os.path.abspath(sys.argv[1]))
