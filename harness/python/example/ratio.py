"""Ratio tracking in numpy: judge it by `python3 ratio.py`."""

import nullmark


@nullmark.tracker(range="unit", guarantee="unbiased", source="Novak, Selle, Jarosz 2014, Alg. 1")
def ratio_in_numpy(ray, samples):
    weight = samples.ones()
    alive = samples.all()
    while alive.size:
        alive, t, rate, extinction = samples.step(alive)
        weight[alive] *= 1 - extinction / rate[:, None]
    return weight


if __name__ == "__main__":
    verdict = nullmark.judge(ratio_in_numpy, "ratio", media=["cosine", "linear"])
    print(verdict)
    raise SystemExit(verdict.exit_code)
