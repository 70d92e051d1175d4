#!/usr/bin/python3
"""schedulers_test.py PROGRAM slurm|mpirun   runs a configuration in parts by a real scheduler and compares it with a whole run.

slurm: starts slurmctld and slurmd on this machine, without munge and systemd, and submits by scripts/slurm/submit.  One task is killed
and requeued.  One gets the signal of the time limit.  One job finishes no cell within its time.  One part is lost.  Needs root.
mpirun: starts four ranks.
Exit code 77: not installed, or not root.  Ends within a minute, and ends whatever it started.
"""
import contextlib
import ctypes
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

LIMIT = 60  # seconds; it takes half of that on two busy cores
TASKS = 4
SUBMIT = Path(__file__).resolve().parents[2] / "scripts" / "slurm" / "submit"
MERGE = SUBMIT.with_name("merge")


def configuration(short, long):
    """Each of four tasks has one short cell, which takes milliseconds, and then a part of each long cell, which take a second."""
    def experiment(name, samples, matrix):
        return {"name": name, "rays": "single", "samples_per_ray": samples, "matrix": matrix}
    matrix = {"estimator": ["ratio", "delta"], "medium": ["linear", "cosine"]}
    return json.dumps({"nullmark": "config/2", "name": "scheduled", "timing": {"enabled": False},
                       "experiments": [experiment("short", short, matrix), experiment("long", long, matrix)]})


# One cell that no time limit of this test lets finish.
ENDLESS = json.dumps({"nullmark": "config/2", "timing": {"enabled": False}, "experiments": [
    {"name": "e", "rays": "single", "samples_per_ray": 10**12, "matrix": {"estimator": "ratio", "medium": "linear"}}]})

# The controller waits for cred_expire before it starts a requeued job again.  It must not be less than the minimum, 5 s.
SLURM_CONF = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmdPort={node_port}
SlurmUser=root
AuthType=auth/none
AuthInfo=cred_expire=5
CredType=cred/none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=1,batch_sched_delay=0
NodeName={host} NodeAddr=127.0.0.1 CPUs=6 State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""

START = time.monotonic()


class Interrupted(Exception):
    """No OSError, as TimeoutError is: those of vanished processes are ignored."""


def say(text):
    print(f"{time.monotonic() - START:5.1f} s  {text}", flush=True)


def expect(condition, text):
    if not condition:
        raise AssertionError(text)


def run(*command, code=0):
    """Standard output of a command that must end with this exit code."""
    ended = subprocess.run([str(part) for part in command], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    expect(ended.returncode == code, f"{command}: exit code {ended.returncode}, expected {code}\n{ended.stdout}{ended.stderr}")
    return ended.stdout + ended.stderr


def wait_for(condition):
    """The first true value of a condition."""
    while not (value := condition()):
        time.sleep(0.02)
    return value


def statistics(file):
    """The cells of a results file, without what may differ between runs; `statistics_text` in C++ drops the same keys."""
    results = json.loads(Path(file).read_text())
    for cell in results["cells"]:
        expect(cell["status"] == "ok", f"{file}: {cell['name']}: {cell['status']}")
        for key in ("time", "instructions", "last_level_misses", "images", "build"):
            cell.pop(key, None)
    return results["config_hash"], results["cells"]


def verdicts(told):
    """The line of `check` that counts them."""
    return re.search(r"^\d+ PASS.*", told, re.M)[0]


def expect_equal(merged, whole):
    expect(len(json.loads(Path(merged).read_text())["provenance"]["parts"]) == TASKS, f"{merged}: expected {TASKS} parts")
    (merged_hash, found), (whole_hash, expected) = statistics(merged), statistics(whole)
    expect(merged_hash == whole_hash, "another configuration")
    expect([cell["name"] for cell in found] == [cell["name"] for cell in expected], "other cells")
    for one, other in zip(found, expected):
        keys = [key for key in one.keys() | other.keys() if one.get(key) != other.get(key)]
        expect(not keys, f"{one['name']}: other {keys}")
    say(f"{merged}: {len(found)} cells, all statistics equal to the last bit")


def processes():
    """Number, parent, command and folder of each process."""
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with contextlib.suppress(OSError, IndexError):
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
                command = (entry / "cmdline").read_bytes().decode(errors="replace").split("\0")
                yield int(entry.name), parent, command, os.readlink(entry / "cwd")


def end_descendants():
    """slurmd's steps leave their parents, and this process adopts them."""
    deadline = time.monotonic() + 5
    while time.monotonic() < deadline:
        parent_of = {number: parent for number, parent, _, _ in processes()}
        ours = {os.getpid()}
        while more := {number for number, parent in parent_of.items() if parent in ours} - ours:
            ours |= more
        ours.remove(os.getpid())
        for number in ours:
            with contextlib.suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
            if ours:
                time.sleep(0.05)
                continue
        return
    print("schedulers_test: processes are left", file=sys.stderr)


def free_ports(count):
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


class Slurm:
    def __init__(self, folder):
        host = socket.gethostname().split(".")[0]
        ports = free_ports(2)
        config = folder / "slurm.conf"
        config.write_text(SLURM_CONF.format(host=host, folder=folder, controller_port=ports[0], node_port=ports[1]))
        (folder / "state").mkdir()
        (folder / "spool").mkdir()
        os.environ["SLURM_CONF"] = str(config)
        for daemon in (["slurmctld", "-D", "-f", config], ["slurmd", "-D", "-N", host, "-f", config]):
            with open(folder / f"{daemon[0]}.log", "w") as log:
                subprocess.Popen(daemon, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
        wait_for(lambda: "idle" in subprocess.run(["sinfo", "-h", "-o", "%T"], capture_output=True, text=True, check=False).stdout)
        say("slurmctld and slurmd are up")

    @staticmethod
    def submit(config, tasks):
        """Numbers of the array and of the job that merges."""
        told = run(SUBMIT, config, tasks, "--time=10")
        say("submit: " + told.strip().replace("\n", "; "))
        return [int(re.search(rf"^{job} (\d+):", told, re.M)[1]) for job in ("array", "merge")]

    @staticmethod
    def show(job, key):
        return re.search(rf"\b{key}=(\S*)", run("scontrol", "--oneliner", "show", "job", job))[1]

    def ended(self, job):
        """State and exit code of a job, once it has ended."""
        def state():
            now = self.show(job, "JobState")
            return now if now not in ("PENDING", "RUNNING", "COMPLETING", "CONFIGURING") else None
        return wait_for(state), self.show(job, "ExitCode")


def program_of(results):
    """The process that writes these results, and its parent, the task's shell."""
    for number, parent, command, folder in processes():
        if results in command and "run" in command and folder == os.getcwd() and os.path.basename(command[0]) == PROGRAM.name:
            return number, parent
    return None


def cells_in_journal(results):
    journal = Path(results + ".journal")
    text = journal.read_text() if journal.exists() else ""
    return text.count('"status":"ok"') + text.count('"drawn_parts":')


def log_of(job):
    """What a job has written; nothing where it never began."""
    log = Path(f"slurm-{job}.out")
    return log.read_text() if log.exists() else ""


def expect_resumed(log):
    """The second attempt finds the short cell and draws the parts of the long ones alone."""
    first, found, second = log.partition("task: attempt 2: finished cells: 1\n")
    expect(found and "] short/" in first, f"expected a second attempt that finds one cell\n{log}")
    expect(not re.search(r"\] long/\S+ part", first), f"the first attempt ended before it was interrupted\n{log}")
    expect(re.search(r"\] long/\S+ part", second), f"expected that the second attempt draws the long parts\n{log}")
    expect("] short/" not in second, f"the second attempt runs the short cell again\n{log}")


def slurm_test(folder):
    slurm = Slurm(folder)
    Path("c.json").write_text(configuration(10**6, 10**8))
    Path("endless.json").write_text(ENDLESS)
    array, merge = slurm.submit("c.json", TASKS)
    part = [f"c.{task + 1}-of-{TASKS}.results.json" for task in range(TASKS)]

    def kill():
        # As where a node is lost: the program writes nothing more.  Its shell is stopped, so that the task does not end by itself.
        program, shell = program_of(part[0])
        os.kill(shell, signal.SIGSTOP)
        os.kill(program, signal.SIGKILL)
        expect(cells_in_journal(part[0]) == 1 and not Path(part[0]).exists(), "expected one cell in the journal, and no results")
        run("scontrol", "requeue", f"{array}_1")
        say("task 1 was killed and requeued; its journal holds one cell, and there are no results")

    def reach_limit():
        # What Slurm sends near the time limit.
        run("scancel", "--signal=USR1", "--batch", f"{array}_2")
        say("task 2 got USR1 after its first cell")

    running = {part[0]: kill, part[1]: reach_limit}
    while running:
        running.pop(wait_for(lambda: next(filter(cells_in_journal, running), None)))()

    # Such a task would be requeued for ever.
    endless, never = slurm.submit("endless.json", 1)
    wait_for(lambda: program_of("endless.1-of-1.results.json"))
    time.sleep(0.5)
    run("scancel", "--signal=USR1", "--batch", f"{endless}_1")
    ended = slurm.ended(f"{endless}_1")
    expect(ended == ("FAILED", "1:0"), f"the task without a finished cell: {ended}")
    expect("no cell was finished within the time limit" in log_of(f"{endless}_1"), log_of(f"{endless}_1"))
    ended = slurm.ended(never)
    expect(ended[0] == "CANCELLED", f"its merge: {ended}")
    say("a task that finished no cell failed, and its merge was cancelled: " + slurm.show(never, "Reason"))

    run(PROGRAM, "run", "c.json", "-o", "whole.json")
    say("the whole run has ended")
    ended = slurm.ended(merge)
    expect(ended == ("COMPLETED", "0:0"), f"merge and check: {ended}; {log_of(merge)}")
    say("check: " + verdicts(log_of(merge)))
    for task in (1, 2):
        expect_resumed(log_of(f"{array}_{task}"))
        expect(slurm.show(f"{array}_{task}", "Restarts") == "1", f"task {task}: expected one restart")
    say("tasks 1 and 2 resumed: their second attempts found one cell and drew the parts of the others")
    expect_equal("c.results.json", "whole.json")

    Path(part[2]).unlink()
    told = run(MERGE, PROGRAM, "c.json", "c", TASKS, code=5)
    expect(f"merge: {part[2]}: missing" in told, told)
    say(told.strip())
    Path("c.results.json").unlink()
    array, merge = slurm.submit("c.json", TASKS)
    expect(slurm.ended(merge) == ("COMPLETED", "0:0"), f"merge and check: {log_of(merge)}")
    expect("] short/" in log_of(f"{array}_3") and "] short/" not in log_of(f"{array}_1"), "expected that part 3 alone runs again")
    say("submitted again, only part 3 ran")
    expect_equal("c.results.json", "whole.json")


def mpirun_test(_):
    Path("c.json").write_text(configuration(10**6, 2 * 10**6))
    run("mpirun", *(["--allow-run-as-root"] if os.geteuid() == 0 else []), "--oversubscribe", "-np", TASKS,
        PROGRAM, "run", "c.json", "--shard", "auto", "--threads", 1)
    say("mpirun has ended")
    run(PROGRAM, "merge", *sorted(Path().glob(f"c.*-of-{TASKS}.results.json")), "-o", "c.results.json")
    say("check: " + verdicts(run(PROGRAM, "check", "c.results.json")))
    run(PROGRAM, "run", "c.json", "-o", "whole.json")
    expect_equal("c.results.json", "whole.json")


def interrupted(number, _):
    raise Interrupted(f"not done after {LIMIT} s" if number == signal.SIGALRM else f"signal {number}")


def main():
    test = {"slurm": slurm_test, "mpirun": mpirun_test}[sys.argv[2]]
    tools = {"slurm": ("slurmctld", "slurmd", "sbatch", "scontrol", "scancel", "sinfo"), "mpirun": ("mpirun",)}[sys.argv[2]]
    missing = [tool for tool in tools if not shutil.which(tool)]
    if missing or (test is slurm_test and os.geteuid() != 0):
        print(f"skipped: {', '.join(missing)} not found" if missing else "skipped: needs root")
        return 77
    # It may run in a job itself.
    for key in [key for key in os.environ if key.startswith(("SLURM_", "SBATCH_", "OMPI_", "PMI"))]:
        del os.environ[key]
    os.environ["NULLMARK_PROGRAM"] = str(PROGRAM)
    subreaper = 36  # PR_SET_CHILD_SUBREAPER
    ctypes.CDLL(None).prctl(subreaper, 1, 0, 0, 0)
    for number in (signal.SIGALRM, signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, interrupted)
    signal.alarm(LIMIT)
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        try:
            test(Path(name))
            return 0
        except Exception as error:  # Whatever it was, the logs tell more.
            say(f"FAILED: {type(error).__name__}: {error}")
            for log in sorted(Path().glob("*.log")) + sorted(Path().glob("slurm-*.out")):
                print(f"--- {log}\n" + "\n".join(log.read_text().splitlines()[-15:]))
            return 1
        finally:
            signal.alarm(0)
            end_descendants()
            os.chdir("/")


PROGRAM = Path(sys.argv[1]).resolve()
sys.exit(main())
