"""What commands print of expressions: tables, records, and where they are read from a file."""
