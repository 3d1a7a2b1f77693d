# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Maps a survey on many machines: the jobs of `planar_map atlas plan` under Dask.

    python3 -m planar_mapping.cluster walk_1 walk_2 -o out --workers 2
    python3 -m planar_mapping.cluster walk_1 walk_2 -o out --scheduler tls://head:8786 --tls-ca ca.pem ...

Without --scheduler the workers are processes of this machine. All machines see the inputs and the output folder under
the same paths and have the same version of planar_map. The same command again goes on where it was stopped.
"""
import argparse
import ipaddress
import json
import logging
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.parse

ATTEMPTS = 3  # of a job
PATIENCE_S = 6  # for the scheduler to answer, and for its first worker
WORKERLESS_S = 60  # for a worker that was lost to come back, where there is no other
# Jobs take seconds, in processes of their own: sampling them all the time would take a tenth of a core for nothing.
SELDOM = {"distributed.worker.profile.interval": "10s", "distributed.admin.tick.interval": "1s",
          "distributed.scheduler.work-stealing-interval": "1s", "distributed.admin.system-monitor.interval": "5s"}


class ClusterError(Exception):
    def __init__(self, message, exit_code=1):
        super().__init__(message)
        self.exit_code = exit_code


def version_of(program):
    """What a worker has: the version of its program, or why there is none."""
    import subprocess

    try:
        return subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError) as error:
        return f"no program {program} ({error})"


def run_job(program, arguments):
    """A job, on a worker; its record stays in the folder but for the components. Its errors come with the worker's name."""
    import json
    import subprocess

    import distributed

    done = subprocess.run([program, "atlas", *arguments], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        text = done.stderr.strip() or f"ended with {done.returncode}"
        raise RuntimeError(f"{text} (worker {distributed.get_worker().name})")
    return json.loads(done.stdout).get("components")


def seconds_text(seconds):
    minutes, seconds = divmod(round(seconds), 60)
    return f"{minutes}:{seconds:02}"


class Progress:
    """How many jobs of a kind are done, and when the last one will be; one line that is drawn over on a terminal."""

    def __init__(self, what, total, quiet):
        self.what, self.total, self.quiet = what, total, quiet
        self.done = 0
        self.start = time.monotonic()
        self.on_terminal = sys.stderr.isatty()

    def step(self):
        self.done += 1
        step = max(1, self.total // 10)
        if self.quiet or not (self.on_terminal or self.done % step == 0 or self.done == self.total):
            return
        elapsed = time.monotonic() - self.start
        left = elapsed / self.done * (self.total - self.done)
        end = "" if self.on_terminal and self.done < self.total else "\n"
        begin = "\r" if self.on_terminal else ""
        text = f"{seconds_text(left)} left" if self.done < self.total else f"took {seconds_text(elapsed)}"
        sys.stderr.write(f"{begin}planar_map: {self.what} {self.done}/{self.total}, {text}   {end}")
        sys.stderr.flush()


def is_loopback(host):
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def security_of(options):
    """Certificates for all connections, or None: then nothing is encrypted and anybody who can connect runs code."""
    files = [options.tls_ca, options.tls_cert, options.tls_key]
    if not any(files):
        return None
    if not all(files):
        raise ClusterError("TLS needs --tls-ca, --tls-cert and --tls-key", 2)
    for file in files:
        if not os.access(file, os.R_OK):
            raise ClusterError(f"{file}: cannot be read", 4)
    from distributed import Security

    ends = {f"tls_{end}_{part}": file for end in ("client", "scheduler", "worker")
            for part, file in (("cert", options.tls_cert), ("key", options.tls_key))}
    return Security(tls_ca_file=options.tls_ca, require_encryption=True, **ends)


def require_safe(host, security, options):
    if security is not None or is_loopback(host):
        return
    if not options.insecure:
        raise ClusterError(f"{host} is reached over the network without TLS: anybody there could run programs on all "
                           "workers. Give --tls-ca, --tls-cert and --tls-key, or --insecure in a network you trust", 2)
    print(f"planar_map: warning: connections with {host} are neither encrypted nor checked", file=sys.stderr)


def connect(options):
    """The client of a cluster, and the cluster if it is our own."""
    import dask
    from distributed import Client, LocalCluster

    security = security_of(options)
    if options.scheduler:
        url = urllib.parse.urlparse(options.scheduler)
        try:
            port = url.port
        except ValueError:
            port = None
        if url.scheme not in ("tcp", "tls") or not url.hostname or port is None:
            raise ClusterError(f"--scheduler is '{options.scheduler}', but must be tcp://HOST:PORT or tls://HOST:PORT", 2)
        require_safe(url.hostname, security, options)
        try:
            client = Client(options.scheduler, timeout=PATIENCE_S, security=security)
            client.wait_for_workers(1, timeout=PATIENCE_S)
        except (OSError, TimeoutError, RuntimeError, TypeError) as error:
            raise ClusterError(f"the scheduler {options.scheduler} does not answer, or has no worker: "
                               f"{error or type(error).__name__}; is it running, and is the address right?", 4) from error
        return client, None
    require_safe(options.host, security, options)
    status = f"{options.host}:0"  # of Dask's pages, which would be open to the network otherwise
    dask.config.set(SELDOM)
    cluster = LocalCluster(n_workers=options.workers, threads_per_worker=1, host=options.host, security=security,
                           protocol="tls" if security else "tcp", dashboard_address=status, worker_dashboard_address=status,
                           silence_logs=logging.CRITICAL, local_directory=tempfile.mkdtemp(prefix="planar_mapping_"))
    return Client(cluster, security=security), cluster


def require_same_version(client, program):
    own = version_of(program)
    if not own.startswith("planar_map "):
        raise ClusterError(f"{own}; --program says where planar_map is", 4)
    workers = client.scheduler_info()["workers"]
    for address, version in client.run(version_of, program).items():
        if version != own:
            name = workers.get(address, {}).get("name", address)
            raise ClusterError(f"worker {name} ({address}) has {version}, and this machine has {own}: install the same "
                               "version everywhere", 4)


def completed(client, futures):
    """Futures, each when it is done. Raises ClusterError once no worker has been there for WORKERLESS_S."""
    from distributed import as_completed

    done = as_completed(futures)
    with_worker = looked = time.monotonic()
    while not done.is_empty():
        if done.has_ready():
            yield next(done)
            continue
        time.sleep(0.02)
        now = time.monotonic()
        if now - looked < 1.0:
            continue
        looked = now
        if client.scheduler_info()["workers"]:
            with_worker = now
        elif now - with_worker > WORKERLESS_S:
            raise ClusterError(f"no worker has been there for {WORKERLESS_S} s; the same command goes on once there is one")


def do_jobs(client, what, jobs, options):
    """Runs jobs {name: arguments}, each up to three times. Returns what the last one said, and which failed."""
    progress = Progress(what, len(jobs), options.quiet)
    # Jobs of one kind have no order among them; a result that is there already costs a job some milliseconds.
    names = {client.submit(run_job, options.program, arguments, key=f"{name}-{time.time_ns()}", retries=ATTEMPTS - 1): name
             for name, arguments in jobs.items()}
    said = None
    failed = []
    for future in completed(client, list(names)):
        name = names[future]
        if future.status == "finished":
            said = future.result()
        else:
            failed.append(name)
            print(f"planar_map: {name} failed {ATTEMPTS} times: {future.exception()}", file=sys.stderr)
        future.release()
        progress.step()
    if failed and not (options.allow_missing and what == "submaps"):
        advice = "; --allow-missing leaves them out" if what == "submaps" else ""
        raise ClusterError(f"{len(failed)} of {len(jobs)} {what} failed; the same command goes on with them{advice}")
    return said, failed


def make_plan(options):
    """The text of the plan: that which was given, or one for the inputs."""
    if options.plan:
        return pathlib.Path(options.plan).read_text()
    with tempfile.TemporaryDirectory() as folder:
        plan = os.path.join(folder, "plan.json")
        command = [options.program, "atlas", "plan", *options.inputs, "-o", plan]
        for name in ("frames", "piece_frames", "submap_frames", "link_pieces", "tile", "seed"):
            value = getattr(options, name)
            command += [] if value is None else ["--" + name.replace("_", "-"), str(value)]
        for assignment in options.set:
            command += ["--set", assignment]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, check=False)
        if done.returncode != 0:
            raise ClusterError("the survey cannot be planned", done.returncode)
        return pathlib.Path(plan).read_text()


def put_plan(options, out):
    """Puts the plan into the folder that all workers see. Returns it, and its path."""
    text = make_plan(options)
    out.mkdir(parents=True, exist_ok=True)
    path = out / "plan.json"
    if path.exists() and path.read_text() != text:
        raise ClusterError(f"{out}: has results of another plan (other inputs, files that changed, other options or another "
                           "version); give another folder, or remove it", 4)
    temporary = out / f".plan.json.{os.getpid()}.tmp"
    temporary.write_text(text)
    temporary.rename(path)
    return json.loads(text), path


def map_survey(options):
    """All jobs of a survey. Returns 0, or 5 if pieces are missing."""
    out = pathlib.Path(options.output).absolute()
    client, cluster = connect(options)
    try:
        require_same_version(client, options.program)
        plan, path = put_plan(options, out)
        names = [f"piece {i} ({plan['sequences'][piece['sequence']]} frames {piece['frames']})"
                 for i, piece in enumerate(plan["pieces"])]
        missing = ["--allow-missing"] if options.allow_missing else []
        tail = ["-o", str(out), "--json"]
        pieces = {name: ["submap", str(path), str(i), *tail] for i, name in enumerate(names)}
        failed = do_jobs(client, "submaps", pieces, options)[1]
        do_jobs(client, "places", {"places": ["places", str(out), "--json", *missing]}, options)
        links = {f"links of {names[i]}": ["links", str(path), str(i), *tail, *missing] for i in range(1, len(names))}
        do_jobs(client, "links", links, options)
        components = do_jobs(client, "solve", {"solve": ["solve", str(out), "--json", *missing]}, options)[0]
        if plan["tile_m"] > 0:
            result = out
            tiles = json.loads((out / "survey.json").read_text())["tiles"]
            do_jobs(client, "tiles", {f"tile {x} {y} of component {component}": ["tile", str(out), str(i), "--json"]
                                      for i, (component, x, y) in enumerate(tiles)}, options)
        else:
            result = out / "map.pmap"
            threads = "0" if options.scheduler else str(options.workers)  # the other workers have nothing to do
            do_jobs(client, "join", {"join": ["join", str(out), "-o", str(result), "-j", threads, "--json"]}, options)
    finally:
        client.close()
        if cluster is not None:
            cluster.close()
    for left in [*out.glob(".*.tmp*"), *out.glob("tiles_*/.*.tmp*")]:  # of workers that were killed
        left.unlink(missing_ok=True)
    if len(components) > 1:
        print(f"planar_map: note: {len(components) - 1} more components have no link with the first; planar_map atlas info "
              f"{out}/survey.atlas lists them", file=sys.stderr)
    if failed:
        print(f"planar_map: warning: {len(failed)} of {len(names)} pieces are missing in the map", file=sys.stderr)
    if not options.quiet:
        print(result)
    return 5 if failed else 0


def options_of(arguments):
    parser = argparse.ArgumentParser(prog="python3 -m planar_mapping.cluster", description="Maps a survey on many machines.")
    parser.add_argument("inputs", nargs="*", help="sequences, each a folder, and a configuration (*.yaml)")
    parser.add_argument("-o", "--output", required=True, help="folder that all workers see")
    parser.add_argument("--plan", help="of planar_map atlas plan, in place of inputs")
    parser.add_argument("--scheduler", help="tcp://HOST:PORT or tls://HOST:PORT of a running cluster; default: workers here")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes here (default: %(default)s)")
    parser.add_argument("--host", default="127.0.0.1", help="address that workers here listen on (default: %(default)s)")
    parser.add_argument("--tls-ca", help="certificate of the authority, PEM")
    parser.add_argument("--tls-cert", help="own certificate, PEM")
    parser.add_argument("--tls-key", help="own key, PEM")
    parser.add_argument("--insecure", action="store_true", help="go over a network without TLS")
    parser.add_argument("--allow-missing", action="store_true", help="leave pieces out that failed three times; exit code 5")
    parser.add_argument("--program", default=os.environ.get("PLANAR_MAP") or shutil.which("planar_map") or "planar_map",
                        help="planar_map on all machines (default: %(default)s)")
    parser.add_argument("-q", "--quiet", action="store_true", help="nothing but warnings and errors")
    plan = parser.add_argument_group("planning, see planar_map atlas plan --help")
    plan.add_argument("--set", action="append", default=[], metavar="STAGE.KEY=VALUE")
    for name in ("--frames", "--piece-frames", "--submap-frames", "--link-pieces", "--tile", "--seed"):
        plan.add_argument(name)
    options = parser.parse_args(arguments)
    if bool(options.inputs) == bool(options.plan):
        parser.error("give sequences, or --plan")
    if options.workers < 1:
        parser.error("--workers must be at least 1")
    return options


def main(arguments=None):
    options = options_of(arguments)
    try:
        import distributed  # noqa: F401
    except ImportError:
        print("planar_map: Dask is missing (apt-get install python3-distributed, or pip install distributed)", file=sys.stderr)
        return 2
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        return map_survey(options)
    except ClusterError as error:
        print(f"planar_map: {error}", file=sys.stderr)
        return error.exit_code
    except OSError as error:
        print(f"planar_map: {error.filename or options.output}: {error.strerror or error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("planar_map: interrupted; the same command goes on", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
