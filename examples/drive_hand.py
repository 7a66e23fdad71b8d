"""Drives a hand from Python: the way in for every glove that only its maker's SDK can read.

    pip install grpcio grpcio-tools
    python -m grpc_tools.protoc -I proto/proto --python_out=. --grpc_python_out=. proto/proto/tsukamu/v1/*.proto
    PYTHONPATH=. python examples/drive_hand.py [ADDRESS] [left|right]

Put what your SDK says into `read_glove` and `read_wrist`; the rest can stay. As it is, it grasps for the cube of the demo scene
(tsukamud --config deploy/tsukamu.toml; tsukamu reset puts the cube back).
"""
import math, sys, time
import grpc
from tsukamu.v1 import common_pb2 as c, hands_pb2 as h, service_pb2_grpc as rpc

ADDRESS = sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:7447"
SIDE = sys.argv[2] if len(sys.argv) > 2 else "right"
RATE_HZ = 90.0

ramp = lambda t, start, end: min(max((t - start) / (end - start), 0.0), 1.0)

def read_glove(t):
    """21 joint angles in radians at time t. Here a hand that closes and opens again every six seconds."""
    bend = 0.75 * (ramp(t % 6, 0.5, 2.0) - ramp(t % 6, 4.5, 5.5))
    thumb = [0.6, 0.3, 0.5 * bend, 0.6 * bend]           # opposition, abduction, MCP and IP flexion
    finger = [1.1 * bend, 1.2 * bend, 0.7 * bend, 0.0]   # MCP, PIP, DIP flexion, abduction
    return thumb + 4 * finger + [0.0]                    # index, middle, ring, little; then the palm arch

def read_wrist(t):
    """Position in metres (y up) and quaternion x, y, z, w: -z to the fingers, +y out of the hand's back. Lifts, lowers."""
    height = 0.09 + 0.1 * (ramp(t % 6, 2.0, 3.0) - ramp(t % 6, 3.3, 4.3))
    return c.Pose(position=c.Vec3(x=0.01, y=height, z=-0.22), rotation=c.Quat(w=1.0))

def samples():
    side = c.SIDE_LEFT if SIDE == "left" else c.SIDE_RIGHT
    yield h.DriveRequest(open=h.DriveOpen(name=f"python:{SIDE}", side=side))
    start, n = time.monotonic(), 0
    while True:
        t = time.monotonic() - start
        yield h.DriveRequest(sample=h.HandSample(
            source_ns=time.monotonic_ns(), wrist=read_wrist(t), angles=read_glove(t),
            valid=True))                                 # False while your SDK has lost the hand
        n = max(n + 1, math.ceil(t * RATE_HZ))           # a late sample is not made up for
        time.sleep(max(0.0, start + n / RATE_HZ - time.monotonic()))

shown = 0.0
try:
    for answer in rpc.HandsStub(grpc.insecure_channel(ADDRESS)).Drive(samples()):
        if answer.WhichOneof("kind") == "opened":
            print(f"hand {answer.opened.hand} is in the world; tsukamu watch shows it; Ctrl-C ends it")
        elif time.monotonic() - shown > 0.5:
            shown, state = time.monotonic(), answer.state
            held = f"object {state.holds - 1}" if state.holds else "nothing"
            print(f"holds {held}, touches with {sorted({contact.part for contact in state.contacts})}")
except grpc.RpcError as error:
    sys.exit(f"{ADDRESS}: {error.details()}")
except KeyboardInterrupt:
    pass
