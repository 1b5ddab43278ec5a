from hyperqueue import Job, LocalCluster
from hyperqueue.cluster import WorkerConfig

TASKS = 6
with LocalCluster(worker_config=WorkerConfig()) as cluster:  # or Client() of a server that runs
    client = cluster.client()
    job = Job(max_fails=None)  # a part in which a case does not hold ends with 2: the others go on
    for _ in range(TASKS):
        job.program(["moreau2d", "sweep", "plan.toml", "--shard", f"/{TASKS}", "--out", "cases"])
    client.wait_for_jobs([client.submit(job)], raise_on_error=False)
