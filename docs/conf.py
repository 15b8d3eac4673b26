"""The documentation as a site: `make docs` builds it into build/docs, without a network."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from hystgen.basics.version import __version__

project = "hystgen"
author = "the hystgen maintainers"
project_copyright = "the hystgen maintainers, MIT licence"
release = version = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx_click", "sphinx_copybutton", "breathe", "generated"]
myst_heading_anchors = 3
default_role = "code"  # docstrings have names in single backquotes
smartquotes = False  # options keep their two dashes, and can be copied
autodoc_typehints = "none"  # signatures have them
autodoc_member_order = "bysource"
breathe_default_project = "emitted"
breathe_domain_by_extension = {"h": "c"}
breathe_show_include = False
breathe_show_define_initializer = True
copybutton_prompt_text = r"\$ |>>> "
copybutton_prompt_is_regexp = True
copybutton_line_continuation_character = "\\"

html_theme = "furo"
html_title = f"hystgen {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
pygments_style = "default"
exclude_patterns = ["_build"]
