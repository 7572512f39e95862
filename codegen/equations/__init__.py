"""The equations as a person reads them: `notation` makes the document; `tex`, `page` and `terminal` write it."""
