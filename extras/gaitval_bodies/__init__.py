"""What a record says about a body if angles and belt err as laboratories' do."""
