"""Tables: their content, and how they are written as Markdown, LaTeX and HTML."""
