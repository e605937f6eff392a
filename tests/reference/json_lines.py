"""Readable JSON: a line for each innermost list or object."""

import json
import re


def text(value):
    def on_a_line(found):
        return re.sub(r"\s+", " ", found[0]).replace("[ ", "[").replace(" ]", "]")
    return re.sub(r"[\[{][^\[\]{}]*[\]}]", on_a_line, json.dumps(value, indent=1)) + "\n"
