"""Names of markers: each once, whatever a file says."""

from __future__ import annotations

from collections.abc import Sequence


def unique_names(labels: Sequence[str], count: int) -> list[str]:
    """Return `count` names: labels, "marker 7" without a label, "name (2)" for a label that comes again."""
    result: list[str] = []
    taken: dict[str, int] = {}
    used = set(labels)
    for number in range(count):
        label = (labels[number].strip() if number < len(labels) else "") or f"marker {number + 1}"
        taken[label] = taken.get(label, 0) + 1
        name = label
        while taken[label] > 1 and (name := f"{label} ({taken[label]})") in used:
            taken[label] += 1
        used.add(name)
        result.append(name)
    return result


def without_subject(labels: list[str]) -> list[str]:
    """Return names without the subject that all of them share: "Anna:Chin" -> "Chin"."""
    subjects = {
        label.partition(":")[0] if ":" in label else "" for label in labels if label[:1] not in ("", "*")
    }
    if len(subjects) != 1 or "" in subjects:
        return labels
    return [label.partition(":")[2] or label for label in labels]
