"""`gudgeon db`: records of a database, listed, compared, copied and removed."""
