"""Functions in files of their own, as what is compiled from its text lies in one."""

import sys
from importlib.util import module_from_spec, spec_from_file_location


def written(folder, text, arguments, name="function"):
    """A function of this body, in a module that knows `math` and `np`."""
    file = folder / f"written_{abs(hash(text))}.py"
    lines = "".join(f"    {line}\n" for line in text.strip().splitlines())
    file.write_text(f"import math\n\nimport numpy as np\n\n\ndef {name}({arguments}):\n{lines}\n\nOTHER = 1\n")
    spec = spec_from_file_location(file.stem, file)
    module = module_from_spec(spec)
    sys.modules[file.stem] = module
    spec.loader.exec_module(module)
    return getattr(module, name)
