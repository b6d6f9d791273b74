import sys,glob,json,re
D,L=sys.argv[1:3]; first=tot=inset=0
for f in sorted(glob.glob(D+'/*.txt')):
    n=f[-7:-4]; l=json.load(open(L+'/%s.json'%n)); t=sorted(e['id'] for e in l['effects'])
    x=open(f).read().splitlines()
    if not x or 'none of mine' not in x[0]: print(n,'failed'); continue
    none=float(re.search(r'mine ([\d.]+)',x[0]).group(1)); sets=[]; marg={}
    for y in x[1:]:
        m=re.match(r'\s+(-?[\d.]+) p ([\d.]+) a (\S+) k (\S+) E (\S+) moves (\S+) (\S*) ?(.*)',y)
        if not m: continue
        s=[q for q in m.group(7).split('+') if q and not q.startswith('[')]
        sets.append((float(m.group(1)),float(m.group(2)),m.group(3),m.group(4),m.group(6),'+'.join(s)))
        for e in s: marg[e]=marg.get(e,0)+float(m.group(2))
    sec=re.search(r'([\d.]+) s$',x[-1]); mg=sorted(marg.items(),key=lambda q:-q[1])[:3]
    print(n,l['kind'],'+'.join(t) or 'none','g/f %.1f'%l['gap_over_floor'],'| none of mine %.2f'%none,'| top',[(s[5] or 'none','%.2f'%s[1],'a'+s[2],'k'+s[3],'m'+s[4]) for s in sets[:2]],'| marginals',[(k,round(v,2)) for k,v in mg],sec.group(1) if sec else '')
    if l['kind']=='single' and l['gap_over_floor']>=1.3:
        tot+=1; first+= bool(mg) and mg[0][0]==t[0]; inset+= t[0] in (sets[0][5].split('+') if sets else [])
print('singles',tot,'first by marginal',first,'in top set',inset)
