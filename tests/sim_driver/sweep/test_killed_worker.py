"""What a worker of a cluster had is not lost with it."""

from __future__ import annotations

import os
import signal

import pytest

from mrslam.sim_driver.sweep.workers import DaskWorkers


@pytest.mark.slow
def test_what_was_shared_outlives_the_worker_that_had_it() -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        dask = DaskWorkers(cluster.scheduler_address)
        try:
            shared = dask.share(b"a drive")
            distributed.wait([shared])
            (killed,) = dask._client.run(os.getpid).values()
            os.kill(killed, signal.SIGKILL)  # its nanny starts another one
            job = dask.submit(len, shared)
            assert dask.next_done({job}) == {job} and job.result() == len(b"a drive")
            assert killed not in dask._client.run(os.getpid).values()
        finally:
            dask.close()
